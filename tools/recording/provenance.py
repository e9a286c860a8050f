"""What was run: program, command line, host, date, files, and what differs from the defaults."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gnss_hil.emulator.config.named_files import leaves
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.common.errors import PROGRAM

INPUTS = "inputs"
LARGEST_COPY_BYTES = 8 << 20
"""Files that a scenario names are copied into the run folder up to this size; larger ones are named."""

_GIT_S = 5.0
_PIECE_BYTES = 1 << 20
_WORDS = ("name", "description")


def program() -> dict[str, str | None]:
    """Version of the program, and its commit where it runs from a git checkout ("-dirty": with changes)."""
    return {"version": version(PROGRAM), "commit": _commit(Path(__file__).resolve().parents[2])}


def _commit(root: Path) -> str | None:
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--exclude=*", "--abbrev=12"]
    try:
        asked = subprocess.run(command, capture_output=True, text=True, timeout=_GIT_S, check=True)
    except (OSError, subprocess.SubprocessError):  # no git, or it does not trust the checkout
        return None
    return asked.stdout.strip() or None


def host() -> dict[str, str]:
    """Where it runs."""
    return {"name": platform.node(), "system": platform.platform(), "python": platform.python_version()}


def now() -> str:
    """UTC, to the second."""
    return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"


def settings(scenario: Scenario) -> dict[str, Any]:
    """What a scenario has other than the defaults, by dotted key, rows of tables by number; a table that is
    only switched on is "on"."""
    document = scenario.model_dump(mode="json", exclude_defaults=True)
    return {key: value for key, value in _flat(document) if key not in _WORDS}


def _flat(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping) and value:
        for name, inner in value.items():
            yield from _flat(inner, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and any(isinstance(row, Mapping) for row in value):
        yield from _flat({str(number): row for number, row in enumerate(value)}, key)
    elif key:
        yield key, "on" if value == {} else value


def take_inputs(document: dict[str, Any], folder: Path) -> list[dict[str, Any]]:
    """Copies the files that a resolved scenario names into a folder's `inputs`, and names the copies in the
    document, relative to it; one row a file: file, sha256, bytes, copy (None where it is too large)."""
    rows: dict[str, dict[str, Any]] = {}
    for owner, key in leaves(document):
        path = Path(owner[key])
        if not (path.is_absolute() and path.is_file()):  # one that ships goes by its name
            continue
        row = rows.get(str(path))
        if row is None:
            row = rows[str(path)] = taken(path, folder, len(rows))
        owner[key] = row["copy"] or owner[key]
    return list(rows.values())


def taken(path: Path, folder: Path, number: int) -> dict[str, Any]:
    """A file copied into a run folder's inputs, or named where it is too large: file, sha256, bytes, copy."""
    size, copy = path.stat().st_size, None
    if size <= LARGEST_COPY_BYTES:
        place = folder / INPUTS / path.name
        if place.exists():  # of the same name in another folder
            place = folder / INPUTS / str(number) / path.name
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, place)
        copy = place.relative_to(folder).as_posix()
    return {"file": str(path), "sha256": sha256(folder / copy if copy else path), "bytes": size, "copy": copy}


def sha256(path: Path) -> str:
    """Of a file of any size."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while piece := file.read(_PIECE_BYTES):
            digest.update(piece)
    return digest.hexdigest()
