"""Keyed random draws: a number for each (seed, craft, epoch, system, receiver, satellite, slot).

A draw is read at its own place of a counter-based generator, never taken "next": it does not depend on
which satellites are tracked, how many receivers there are, or which factors are on. Philox 4x64-10 makes
four words for each counter value; one value belongs to one satellite at one receiver, its words to the
slots. Source: Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

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


_PLACES = {
    "code_noise": (MEASUREMENTS, 0), "carrier_noise": (MEASUREMENTS, 1), "doppler_noise": (MEASUREMENTS, 2),
    "cycle_slips": (MEASUREMENTS, 3), "bounded_wander": (CLOCKS, 0), "clock_instability": (OSCILLATORS, 0),
    "attitude_error": (GYROS, 0), "onboard_clock": (COMPUTER, 0), "interchannel_bias": (BIASES, 0),
    "code_bias": (CODE_BIASES, 0),
}  # fmt: skip
"""Stream and slot of what draws, by name."""

_LOW32, _HALF = np.uint64(0xFFFFFFFF), np.uint64(32)


def _product(a: np.uint64, b: NDArray[np.uint64]) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """High and low words of the products of a word with words."""
    b_low, b_high, a_low, a_high = b & _LOW32, b >> _HALF, a & _LOW32, a >> _HALF
    low, cross, high = a_low * b_low, a_low * b_high, a_high * b_high
    middle = (low >> _HALF) + a_high * b_low
    middle, carry = middle & _LOW32, middle >> _HALF
    return high + (cross >> _HALF) + carry + ((middle + (cross & _LOW32)) >> _HALF), a * b


def philox(counter: tuple[NDArray[np.uint64], ...], key: tuple[int, int]) -> NDArray[np.uint64]:
    """Philox 4x64-10: words (4, p) at four words of counters, (p,) each. Source: Salmon et al., SC11."""
    a, b, c, d = counter
    for number in range(10):
        one = np.uint64((key[0] + number * 0x9E3779B97F4A7C15) % 2**64)
        two = np.uint64((key[1] + number * 0xBB67AE8584CAA73B) % 2**64)
        high_a, low_a = _product(np.uint64(0xD2E7470EE14C6C93), a)
        high_c, low_c = _product(np.uint64(0xCA5A826395121157), c)
        a, b, c, d = high_c ^ b ^ one, low_c, high_a ^ d ^ two, low_a
    return np.stack((a, b, c, d))


@dataclass(frozen=True, slots=True)
class Stream:
    """The draws of one model: seed of the run, key of whom they belong to, name of the model."""

    seed: int
    key: int
    name: str

    def words(self, number: int, count: int) -> NDArray[np.uint64]:
        """(count, SLOTS) words at a number, of an epoch say."""
        return words(self.seed, self.key, _PLACES[self.name][0], number, count)

    def of_signals(
        self, epoch: NDArray[np.int64], receiver: NDArray[np.int64], sat: NDArray[np.int64]
    ) -> NDArray[np.uint64]:
        """A word (p,) for each epoch, receiver (0-based) and satellite index (p,)."""
        stream, slot = _PLACES[self.name]
        system, number = satellites.system_of(sat), satellites.number_of(sat)
        place = (system * MAX_RECEIVERS + receiver) * satellites.NUMBERS + number
        # NumPy's generator counts before it draws.
        first = (place + 1).astype(np.uint64)
        zero = np.zeros_like(first)
        counter = first, epoch.astype(np.uint64), zero + np.uint64(stream), zero
        # As NumPy reads the two: through floating-point numbers, where one of them is beyond 63 bits.
        key = np.asarray((self.seed, self.key)).astype(np.uint64)
        return philox(counter, (int(key[0]), int(key[1])))[slot]
