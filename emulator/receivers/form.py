"""Forms: several kinds of frames that are filled in together from the same columns.

A tracked channel is ten frames; encoding them kind by kind costs ten times the array overhead. A form
joins the codec's layouts of its kinds into one table, and a row of values becomes all its frames at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc.codec import Codec

_HEADER = ("e2e_crc", "e2e_counter", "epoch_mod16")


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """Signals of k kinds, s in all; columns (s, 1) as in the codec's layouts.

    names   (u,) distinct signal names: a name that occurs in several kinds is one quantity
    pick    (s,) which name a signal carries
    starts  (k,) first signal of each kind
    weight  (k, s) 2^shift where a signal belongs to a kind: packing is a dot product modulo 2^64
    """

    kinds: tuple[str, ...]
    names: tuple[str, ...]
    pick: NDArray[np.intp]
    starts: NDArray[np.intp]
    offset: NDArray[np.float64]
    factor: NDArray[np.float64]
    raw_min: NDArray[np.float64]
    raw_max: NDArray[np.float64]
    mask: NDArray[np.int64]
    weight: NDArray[np.int64]

    def fill(self, n: int, values: Mapping[str, object]) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        """Payloads (n, k, 8), rounded half to even, from a scalar or (n,) for every name.

        returns also (n, k): whether all values of a frame fit their signals; the others are meaningless
                and must not be sent
        """
        columns = np.empty((len(self.names), n))
        for i, name in enumerate(self.names):
            columns[i] = values[name]
        raw = np.rint((columns.take(self.pick, axis=0) - self.offset) / self.factor)
        fits = (raw >= self.raw_min) & (raw <= self.raw_max)
        if fits.all():
            whole = np.ones((n, len(self.kinds)), bool)
        else:
            whole = np.logical_and.reduceat(fits, self.starts, axis=0).T
            raw = np.where(fits, raw, 0)
        bits = raw.astype(np.int64) & self.mask
        payloads = np.ascontiguousarray((self.weight @ bits).T, "<i8")
        return payloads.view(np.uint8).reshape(n, len(self.kinds), 8), whole


def form(codec: Codec, kinds: Sequence[str]) -> Form:
    """The form of these kinds, protection headers left blank."""
    layouts = [codec.kinds[kind] for kind in kinds]
    rows = [[i for i, s in enumerate(layout.signals) if s not in _HEADER] for layout in layouts]
    signals = [layout.signals[i] for layout, r in zip(layouts, rows, strict=True) for i in r]
    names = tuple(dict.fromkeys(signals))

    def column(field: str, dtype) -> NDArray:
        parts = [getattr(layout, field)[r] for layout, r in zip(layouts, rows, strict=True)]
        return np.concatenate(parts).astype(dtype)[:, None]

    lengths = np.array([len(r) for r in rows])
    kind_of_signal = np.repeat(np.arange(len(rows)), lengths)
    shift = column("shift", np.int64)[:, 0]
    weight = np.where(kind_of_signal == np.arange(len(rows))[:, None], np.left_shift(1, shift), 0)
    return Form(
        tuple(kinds),
        names,
        np.array([names.index(s) for s in signals]),
        np.cumsum(lengths) - lengths,
        column("offset", np.float64),
        column("factor", np.float64),
        column("raw_min", np.float64),
        column("raw_max", np.float64),
        column("mask", np.int64),
        weight,
    )
