"""What another's program says: kept in a file, and passed on to our stderr."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path

_PIECE = 1 << 16
_LAST_WORDS_S = 1.0
"""How long to wait for what is still in the pipe: who inherited it from the program may hold it open."""

STDERR = 2


class Tee:
    """A pipe for stdout and stderr of one program. Files that cannot be written cost the record, never the
    program: the pipe is read to its end.

    writing   descriptor of its writing end
    """

    def __init__(self, path: Path):
        self._path = path
        self._reading, self.writing = os.pipe()
        self._thread = threading.Thread(target=self._copy, name=f"tee {path.name}", daemon=True)

    def begin(self) -> None:
        """Once the program has its end of the pipe."""
        os.close(self.writing)
        self._thread.start()

    def finish(self) -> None:
        """Once the program has left."""
        self._thread.join(_LAST_WORDS_S)

    def _copy(self) -> None:
        with self._path.open("ab", buffering=0) as file:
            while piece := os.read(self._reading, _PIECE):
                with suppress(OSError):
                    file.write(piece)
                with suppress(OSError):
                    _write_whole(STDERR, piece)
        os.close(self._reading)


def _write_whole(descriptor: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]
