"""Files that are there whole or not at all: written beside their place, then moved to it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """A path in the same folder to write to, which takes its place at `path` at the end, and is gone if
    anything goes wrong. It has the same suffix, in small letters, for writers that go by it.

    An OSError names `path`: the draft is no business of the user's.
    """
    draft = path.with_name(f".{path.name}.draft{path.suffix.lower()}")
    try:
        yield draft
        draft.replace(path)
    except OSError as error:
        if error.filename in (None, str(draft), draft):
            error.filename, error.filename2 = str(path), None
        raise
    finally:
        with suppress(OSError):  # what went wrong is worth more than what is left of it
            draft.unlink(missing_ok=True)
