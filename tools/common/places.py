"""Where a command may write: what is there stays, unless `--force` says otherwise."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from gnss_hil.tools.common.errors import Mistake


def check_new_folder(path: Path, option: str = "--out", forceable: bool = False) -> None:
    """Mistake if there is anything at `path` but an empty folder.

    forceable  whether the command has a --force, to be named if it would help
    """
    if path.is_dir() and not any(path.iterdir()):
        return
    if path.exists() or path.is_symlink():
        helps = "; --force overwrites what is in it" if forceable and path.is_dir() else ""
        raise Mistake(f"{option} {path}: exists and is not an empty folder{helps}")


def check_new_file(path: Path, force: bool, name: str | None = None) -> None:
    """Mistake if a file cannot be written to `path`, or is there and may not be overwritten.

    name  what to call it, `--out FILE` for example; its path by itself
    """
    name = name or str(path)
    if path.is_dir():
        raise Mistake(f"{name}: is a folder; name a file")
    if path.exists() and not force:
        raise Mistake(f"{name}: exists; --force overwrites it")
    if not path.absolute().parent.is_dir():
        raise Mistake(f"{name}: no such folder {path.parent}")


def check_new_files(paths: Iterable[Path], force: bool) -> None:
    """Mistake if files are there that may not be overwritten."""
    taken = [path for path in paths if path.exists()]
    if taken and not force:
        more = f" and {len(taken) - 1} more" if len(taken) > 1 else ""
        raise Mistake(f"{taken[0]}{more}: exists; --force overwrites")


def check_folder(path: Path, option: str = "--out") -> None:
    """Mistake if something else than a folder is at `path`."""
    if path.exists() and not path.is_dir():
        raise Mistake(f"{option} {path}: is a file; name a folder")


def make_folder(path: Path, option: str = "--out") -> None:
    """A folder, there already or made now with those above it; Mistake if it cannot be."""
    check_folder(path, option)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Mistake(f"{option} {path}: cannot be made: {error.strerror}") from None
