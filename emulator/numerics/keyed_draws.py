"""Keyed random draws: a number for each (seed, craft, epoch, system, receiver, satellite, slot).

A draw is read at its own place of a counter-based generator, never taken "next": it does not depend on
which satellites are tracked, how many receivers there are, or which factors are on. Philox 4x64-10 makes
four words for each counter value; one value belongs to one satellite at one receiver, its words to the
slots. Source: Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11.
"""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.messages import MAX_RECEIVERS

SLOTS = 4

# Streams: third word of the counter. Those of one craft carry its key.
MEASUREMENTS, CLOCKS, OSCILLATORS, GYROS, COMPUTER, BIASES = range(6)

SKY_KEY = 0
"""Key of what satellites do: one for all craft and receivers."""

# Streams of the sky.
UPLOAD_ORBITS, UPLOAD_CLOCKS, CLOCK_MINUTES, CODE_BIASES, UPLOAD_TIMES = range(16, 21)


def key_of(name: str) -> int:
    """64 bits that stand for a name."""
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little")


def words(seed: int, craft_key: int, stream: int, epoch: int, count: int) -> NDArray[np.uint64]:
    """The first (count, SLOTS) words of a stream at an epoch."""
    generator = np.random.Philox(key=(seed, craft_key), counter=(0, epoch, stream, 0))
    return generator.random_raw(count * SLOTS).reshape(count, SLOTS)


def uniform(raw: NDArray[np.uint64]) -> NDArray[np.float64]:
    """Words to numbers in (0, 1), both ends excluded: the middles of 2^52 equal cells."""
    return ((raw >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52


def grid(seed: int, craft_key: int, epoch: int, systems: int) -> NDArray[np.uint64]:
    """Words (systems, MAX_RECEIVERS, NUMBERS, SLOTS) of one epoch for the first `systems` systems.

    Systems come first, so that more of them only lengthen the stream.
    """
    count = systems * MAX_RECEIVERS * satellites.NUMBERS
    raw = words(seed, craft_key, MEASUREMENTS, epoch, count)
    return raw.reshape(systems, MAX_RECEIVERS, satellites.NUMBERS, SLOTS)


def normal(raw: NDArray[np.uint64]) -> NDArray[np.float64]:
    """Words to standard normal numbers, one each, by the inverse distribution function."""
    from scipy.special import ndtri  # slow to load, and a run without noise needs none

    return ndtri(uniform(raw))
