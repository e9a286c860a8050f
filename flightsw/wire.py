"""Sheets: groups of frames that say one thing together, read and written in one piece.

Ten frames of a channel, three of the time mark, or the whole navigation block are each one sheet. Reading
a sheet frame by frame costs a dozen array operations a frame; as a sheet it costs them once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc.codec import Codec

_HEADER = ("e2e_crc", "e2e_counter", "epoch_mod16")


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Payload signals of k frames, one after another; s signals in all.

    kinds     (k,) frame kinds in order; a kind may repeat
    names     (s,) signal names, made unique for repeated kinds as 'name:2', 'name:3'
    frame     (s,) which frame a signal is in
    starts    (k,) first signal of each frame
    shift, mask, sign_bit, factor, offset, raw_min, raw_max   (s,) as in the codec
    """

    kinds: tuple[str, ...]
    names: tuple[str, ...]
    frame: NDArray[np.intp]
    starts: NDArray[np.intp]
    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    sign_bit: NDArray[np.int64]
    factor: NDArray[np.float64]
    offset: NDArray[np.float64]
    raw_min: NDArray[np.float64]
    raw_max: NDArray[np.float64]

    def read(self, words: NDArray[np.uint64]) -> dict[str, NDArray[np.float64]]:
        """Payload words (n, k) -> physical values, name -> (n,) float64; exact, no signal exceeds 53 bits."""
        raw = ((words.T[self.frame] >> self.shift[:, None]) & self.mask[:, None]).view(np.int64)
        sign_bit = self.sign_bit[:, None]
        physical = ((raw ^ sign_bit) - sign_bit) * self.factor[:, None] + self.offset[:, None]
        return dict(zip(self.names, physical, strict=True))

    def write(self, values: Sequence[float]) -> NDArray[np.uint8]:
        """Payloads (k, 8) from values (s,) in the order of `names`, rounded half to even; what does not fit
        saturates."""
        raw = np.rint((np.array(values, float) - self.offset) / self.factor)
        raw = np.minimum(np.maximum(raw, self.raw_min), self.raw_max)
        bits = (raw.astype(np.int64).view(np.uint64) & self.mask) << self.shift
        return np.bitwise_or.reduceat(bits, self.starts).astype("<u8").view(np.uint8).reshape(-1, 8)


def sheet(codec: Codec, kinds: Sequence[str], drop: Sequence[str] = ()) -> Sheet:
    """The sheet of these kinds, protection header and signals named in `drop` left out."""
    names: list[str] = []
    rows: list[tuple[int, str, int]] = []
    for k, kind in enumerate(kinds):
        for i, name in enumerate(codec.kinds[kind].signals):
            if name in _HEADER or name in drop:
                continue
            copies = sum(known.partition(":")[0] == name for known in names)
            names.append(name if not copies else f"{name}:{copies + 1}")
            rows.append((k, kind, i))

    def column(attribute: str) -> NDArray:
        return np.array([getattr(codec.kinds[kind], attribute)[i] for _, kind, i in rows])

    frame = np.array([k for k, _, _ in rows])
    return Sheet(
        tuple(kinds),
        tuple(names),
        frame,
        np.searchsorted(frame, np.arange(len(kinds))),
        *(column(a) for a in ("shift", "mask", "sign_bit", "factor", "offset", "raw_min", "raw_max")),
    )
