"""Keyed random draws: a number for each (seed, owner, model, epoch, receiver, satellite).

A draw is read at its own place of a counter-based generator, never taken "next": it does not depend on
which satellites are tracked, how many receivers there are, or which models are on. Philox 4x64-10 is keyed by
the seed and by whom the draws belong to, a craft or the sky; its counter by the model's name and a number.
Source: Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist

import numpy as np

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.dbc.common.arrays import F64, I64, U64
from gnss_hil.dbc.common.limits import MAX_RECEIVERS

SKY_KEY = 0
"""Key of what satellites do: one for all craft and receivers."""

STRETCH = 64
"""Epochs whose draws are made together: one after another in the stream, for they are asked for so."""

_PARTS = signals.COUNT * systems.COUNT * MAX_RECEIVERS

_BEYOND_FIRST = signals.beyond_first()
"""Draws of a system's first signal are those of the satellite; others have their own."""


def key_of(name: str) -> int:
    """64 bits that stand for a name."""
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little")


@dataclass(frozen=True, slots=True)
class Stream:
    """The draws of one model: seed of the run, key of whom they belong to, name of the model."""

    seed: int
    owner: int
    name: str

    def words(self, number: int, count: int) -> U64:
        """(count,) words at a number: of an hour, an upload, 0 of a run."""
        return _words(self, number, 0, count)

    def of_epoch(self, epoch: int, count: int) -> U64:
        """(count,) words of an epoch."""
        return _epochs(self, epoch // STRETCH, count)[epoch % STRETCH]

    def normal_of_epoch(self, epoch: int, count: int) -> F64:
        """(count,) standard normal numbers of an epoch, of its words."""
        return _normal_epochs(self, epoch // STRETCH, count)[epoch % STRETCH]

    def of_signals(self, epoch: I64, receiver: I64, sat: I64, signal: I64) -> U64:
        """A word (p,) for each epoch, receiver (0-based), satellite index and signal, by its value on the
        bus (p,)."""
        stretch, within = np.divmod(epoch, STRETCH)
        part = (_BEYOND_FIRST[signal] * systems.COUNT + satellites.system_of(sat)) * MAX_RECEIVERS + receiver
        place = satellites.number_of(sat) * STRETCH + within
        group = stretch * _PARTS + part
        out = np.empty(len(place), np.uint64)
        for one in np.unique(group).tolist():
            mine = group == one
            out[mine] = _signals(self, *divmod(one, _PARTS))[place[mine]]
        return out


def _words(stream: Stream, number: int, part: int, count: int) -> U64:
    """(count,) words; parts of a number do not overlap."""
    key = np.array((stream.seed, stream.owner), np.uint64)
    counter = np.array((0, number % 2**64, key_of(stream.name), part), np.uint64)
    return np.random.Philox(key=key, counter=counter).random_raw(count)


@lru_cache(maxsize=256)
def _signals(stream: Stream, stretch: int, part: int) -> U64:
    """Words of a stretch of epochs, a receiver and the satellites of a system: by number, then by epoch."""
    return _words(stream, stretch, 1 + part, satellites.NUMBERS * STRETCH)


@lru_cache(maxsize=32)
def _epochs(stream: Stream, stretch: int, count: int) -> U64:
    """Words (STRETCH, count) of a stretch of epochs."""
    return _words(stream, stretch, 0, STRETCH * count).reshape(STRETCH, count)


@lru_cache(maxsize=32)
def _normal_epochs(stream: Stream, stretch: int, count: int) -> F64:
    """Standard normal numbers (STRETCH, count) of a stretch of epochs."""
    return normal(_epochs(stream, stretch, count))


def uniform(raw: U64) -> F64:
    """Words to numbers in (0, 1), both ends excluded: the middles of 2^52 equal cells."""
    return ((raw >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52


def normal(raw: U64) -> F64:
    """Words (...) to standard normal numbers (...), one each, by the inverse distribution function.

    The standard library's (Wichura, AS 241): scipy.special takes longer to load than a short run to play.
    """
    drawn = map(_QUANTILE, uniform(raw).ravel().tolist())
    return np.fromiter(drawn, np.float64, raw.size).reshape(raw.shape)


_QUANTILE = NormalDist().inv_cdf
