"""Many frames of many kinds written or read at once.

The codec works on the frames of one kind. An epoch brings two dozen kinds of a few frames each, and
doing it kind by kind costs hundreds of array operations. A `Form` joins the layouts of its kinds into one
table, one signal after another, and writes them in one pass; a `Reader` has the layouts of signals that
are read together, however many frames and kinds they come from. Both equal the codec bit for bit.

Protection headers are written blank (`gnss_hil.dbc.contract.e2e.protect` fills them in) and not read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gnss_hil.dbc.contract.codec import Codec, Layout
from gnss_hil.dbc.contract.messages import HEADER_NAMES


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """Frames of k kinds to be written together, s payload signals one after another; a kind may repeat.

    names   (u,) distinct signal names
    pick    (s,) which name a signal has
    starts  (k,) first signal of each frame
    shifted whether any signal has an offset
    shift, mask, factor, offset, raw_min, raw_max   (s, 1) as in the codec's layouts
    """

    kinds: tuple[str, ...]
    names: tuple[str, ...]
    pick: NDArray[np.intp]
    starts: NDArray[np.intp]
    shifted: bool
    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    factor: NDArray[np.float64]
    offset: NDArray[np.float64]
    raw_min: NDArray[np.float64]
    raw_max: NDArray[np.float64]

    def fill(self, n: int, values: Mapping[str, ArrayLike]) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        """As `write`, from a scalar or (n,) for every name: a name in several kinds is one quantity."""
        columns = np.empty((len(self.names), n))
        for i, name in enumerate(self.names):
            columns[i] = values[name]
        return self.write(columns.take(self.pick, axis=0))

    def write(self, values: NDArray[np.float64]) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        """Payloads (n, k, 8) from physical values (s, n), rounded half to even.

        A value that its signal cannot carry saturates; nan is written as raw zero. Also returned is (n, k),
        which frames say exactly what they were given: a caller that must not send the others leaves them out.
        """
        scaled = (values - self.offset if self.shifted else values) / self.factor
        np.rint(scaled, out=scaled)
        raw = np.minimum(np.maximum(scaled, self.raw_min), self.raw_max)
        fits = raw == scaled
        if fits.all():
            whole = np.ones((values.shape[1], len(self.kinds)), bool)
        else:
            whole = np.logical_and.reduceat(fits, self.starts, axis=0).T
            raw[np.isnan(raw)] = 0
        bits = raw.astype(np.int64).view(np.uint64)
        bits &= self.mask
        bits <<= self.shift
        words = np.bitwise_or.reduceat(bits, self.starts, axis=0)
        payloads = np.ascontiguousarray(words.T, "<u8").view(np.uint8)
        return payloads.reshape(*whole.shape, 8), whole


def form(codec: Codec, kinds: Sequence[str]) -> Form:
    """The form of these kinds, in this order."""
    layouts = [codec.kinds[kind] for kind in kinds]
    rows = [_payload(layout) for layout in layouts]
    signals = [layout.signals[i] for layout, r in zip(layouts, rows, strict=True) for i in r]
    names = tuple(dict.fromkeys(signals))

    def column(name: str) -> NDArray:
        parts = [getattr(layout, name)[r] for layout, r in zip(layouts, rows, strict=True)]
        return np.concatenate(parts)[:, None]

    offset = column("offset")
    return Form(
        kinds=tuple(kinds),
        names=names,
        pick=np.array([names.index(s) for s in signals]),
        starts=np.cumsum([0, *map(len, rows[:-1])]),
        shifted=bool(offset.any()),
        shift=column("shift"),
        mask=column("mask"),
        factor=column("factor"),
        offset=offset,
        raw_min=column("raw_min"),
        raw_max=column("raw_max"),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """s signals of records that consist of several frames.

    names    (s,) of the signals; in a joined reader of the parts
    frame    (s,) which frame of a record has each
    shifted  whether any signal has an offset
    shift, mask, sign_bit, factor, offset   (s, 1) as in the codec's layouts; (s,) in a joined reader
    """

    names: tuple[str, ...]
    frame: NDArray[np.intp]
    shifted: bool
    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    sign_bit: NDArray[np.int64]
    factor: NDArray[np.float64]
    offset: NDArray[np.float64]

    def read(self, words: NDArray[np.uint64]) -> NDArray[np.float64]:
        """Physical values (s, n) from the payloads (s, n) that carry them, each one little-endian word; in a
        joined reader (s,) from (s,). Unscaled signals are exact up to 53 bits."""
        bits = words >> self.shift
        bits &= self.mask
        raw = bits.view(np.int64)
        raw ^= self.sign_bit
        raw -= self.sign_bit
        values = raw * self.factor
        return values + self.offset if self.shifted else values


def reader(codec: Codec, kinds: Sequence[str], names: Sequence[str]) -> Reader:
    """Of the named signals of records that consist of one frame of each kind; a signal that several frames
    have is read from the last of them."""
    layouts = [codec.kinds[kind] for kind in kinds]
    frame = [max(k for k, layout in enumerate(layouts) if name in layout.signals) for name in names]
    place = [(layouts[k], layouts[k].signals.index(name)) for k, name in zip(frame, names, strict=True)]

    def column(of: str) -> NDArray:
        return np.array([getattr(layout, of)[i] for layout, i in place])[:, None]

    offset = column("offset")
    return Reader(
        names=tuple(names),
        frame=np.array(frame, np.intp),
        shifted=bool(offset.any()),
        shift=column("shift"),
        mask=column("mask"),
        sign_bit=column("sign_bit"),
        factor=column("factor"),
        offset=offset,
    )


def joined(parts: Sequence[tuple[Reader, int]]) -> Reader:
    """One reader for n records of each: signal after signal, of each signal record after record."""
    names = tuple(name for part, _ in parts for name in part.names)
    row = np.repeat(np.arange(len(names)), [n for part, n in parts for _ in part.names])

    def column(of: str) -> NDArray:
        return np.concatenate([getattr(part, of).ravel() for part, _ in parts]).take(row)

    return Reader(
        names=names,
        frame=column("frame"),
        shifted=any(part.shifted for part, _ in parts),
        shift=column("shift"),
        mask=column("mask"),
        sign_bit=column("sign_bit"),
        factor=column("factor"),
        offset=column("offset"),
    )


def _payload(layout: Layout) -> list[int]:
    """Rows of a layout's signals behind the protection header."""
    return [i for i, name in enumerate(layout.signals) if name not in HEADER_NAMES]
