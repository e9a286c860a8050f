"""What can go wrong for a program that uses the bench."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gnss_hil.tools.command_line.main import status_and_text


class BenchError(Exception):
    """One line a fault: what, where, what was found, what is allowed; as `gnss-hil` says it on stderr.

    status   as the command's exit status: 1 the run failed, 2 a mistake in what was asked for or in a file,
             3 the environment lacks something
    folder   run folder with all that was recorded; None where nothing was
    """

    def __init__(self, text: str, status: int = 2, folder: Path | None = None):
        super().__init__(text)
        self.status, self.folder = status, folder


BenchError.__module__ = "gnss_hil"  # where programs have it from, and how tracebacks call it


@contextmanager
def as_bench_errors(folder: Path | None = None) -> Iterator[None]:
    """What people can understand becomes a BenchError; a fault of the program passes as it is.

    folder   of a run that is about to begin: the error has it if it is ours by then, and holds anything
    """
    taken = _holds_anything(folder)
    try:
        yield
    except Exception as error:
        known = None if isinstance(error, BenchError) else status_and_text(error)
        if known is None:
            raise
        status, text = known
        ours = _holds_anything(folder) and not taken
        raise BenchError(text, status, folder if ours else None) from None


def _holds_anything(folder: Path | None) -> bool:
    return folder is not None and folder.is_dir() and any(folder.iterdir())
