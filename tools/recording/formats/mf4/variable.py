"""Values of variable length: u32 length and bytes, one behind the other, found by their offset."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import WIDTH
from gnss_hil.tools.recording.formats.mf4.frames import Payloads
from gnss_hil.tools.recording.formats.piece import LogError

LENGTH_BYTES = 4
MOST_HELD = 1 << 28
"""What is held at a time: offsets go up through a sound file."""


def lengths(octets: NDArray[np.uint8], at: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) lengths that stand at places (n,)."""
    words = octets[at[:, None] + np.arange(LENGTH_BYTES)].astype(np.int64)
    return (words << 8 * np.arange(LENGTH_BYTES)).sum(axis=1)


class Values:
    """A stream of values of which a stretch is held.

    more  gives the following stretches; none where `add` does
    """

    def __init__(self, origin: str, more: Iterator[bytes] | None = None):
        self._origin = origin
        self._more = more or iter(())
        self._begin = 0
        self._held = bytearray()

    @property
    def end(self) -> int:
        """The offset behind what is held."""
        return self._begin + len(self._held)

    def add(self, octets: bytes) -> None:
        self._held += octets
        if len(self._held) > MOST_HELD:
            raise LogError(
                f"{self._origin}: is damaged: data of frames are more than {MOST_HELD >> 20} MiB apart"
            )

    def forget(self, offset: int) -> None:
        """What lies before an offset is not asked for any more."""
        if self._begin < offset <= self.end:
            del self._held[: offset - self._begin]
            self._begin = offset

    def payloads(self, offset: NDArray[np.int64]) -> Payloads:
        """The values at offsets (n,), as far as they are there."""
        if not len(offset):
            return Payloads(np.zeros((0, WIDTH), np.uint8), np.zeros(0, np.int64), np.zeros(0, bool))
        self.forget(int(offset.min()))
        need = int(offset.max()) + LENGTH_BYTES + WIDTH
        while self.end < need and (part := next(self._more, None)) is not None:
            self.add(part)
            if self.end <= int(offset.min()):
                self.forget(self.end)
        held = np.frombuffer(bytes(self._held) + bytes(LENGTH_BYTES + WIDTH), np.uint8)
        at = offset - self._begin
        missing = (at < 0) | (at + LENGTH_BYTES > len(self._held))
        at = np.where(missing, 0, at)
        length = lengths(held, at)
        missing |= at + LENGTH_BYTES + np.minimum(length, WIDTH) > len(self._held)
        data = held[at[:, None] + LENGTH_BYTES + np.arange(WIDTH)]
        data[np.arange(WIDTH) >= length[:, None]] = 0
        return Payloads(data, np.where(missing, 0, length), missing)
