"""The frame budget: what an epoch costs on the bus, before anything flies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.bits import TRAILER_BITS, frame_bits
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.dbc.contract.messages import BIT_RATE, MEASUREMENT_KINDS, values_of

LIMIT_PERCENT = 80.0

_STUFFED_BITS = 34 + 64  # start of frame to CRC, eight bytes of data
WORST_BITS = _STUFFED_BITS + (_STUFFED_BITS - 1) // 4 + TRAILER_BITS
"""Longest eight-byte base frame with intermission: a stuff bit after five bits, then every four."""


def typical_bits() -> float:
    """Mean length of eight-byte frames with random identifiers and payloads."""
    draw = np.random.default_rng(0)
    return float(
        frame_bits(batch(draw.integers(0, 0x7E0, 20_000), draw.integers(0, 256, (20_000, 8)))).mean()
    )


@dataclass(frozen=True, slots=True)
class Row:
    """A group of frames: how many in an epoch at most, how many of them the flight node sends, and whether
    they come only when something happens."""

    what: str
    frames: int
    flight: int = 0
    event: bool = False


def rows(
    vehicle: Vehicle, interval_s: float, almanac_satellites: int, almanac_cycle_s: float
) -> Iterator[Row]:
    """The frames of an epoch in which every channel tracks."""
    m, channels = vehicle.antennas, int(vehicle.channels.sum())
    domains = len(set(vehicle.clock_domain.tolist()))
    slice_satellites = ceil(almanac_satellites * min(interval_s / almanac_cycle_s, 1.0))
    yield Row("time mark", 3)
    yield Row("attitude", 3)
    yield Row("measurements, ten a channel", len(MEASUREMENT_KINDS) * channels)
    yield Row("tags and status", 2 * m)
    yield Row("almanac, a slice for each receiver", 3 * m * slice_satellites)
    # Status, state; position, velocity; clocks, rates, their sigmas; sigmas, correlations; channels used.
    navigation = 2 + 3 + 3 + 3 * (domains + 1) + 4 + m
    yield Row("navigation", navigation, flight=navigation)
    refusals = values_of("NAV_REFUSED", "slot")
    yield Row("refusals", refusals, flight=refusals, event=True)
    yield Row("heartbeats", m + 3, flight=1)
    yield Row("commands and answers, all channels at once", 4 * channels, flight=2 * channels, event=True)


@dataclass(frozen=True, slots=True)
class Budget:
    """Frames and load of one bus; `worst` with the longest frames and every event in one epoch."""

    rows: tuple[Row, ...]
    interval_s: float

    def frames(self, events: bool) -> int:
        return sum(r.frames for r in self.rows if events or not r.event)

    def load_percent(self, bits: float, events: bool) -> float:
        return 100 * self.frames(events) * bits / (self.interval_s * BIT_RATE)

    @property
    def worst_percent(self) -> float:
        return self.load_percent(WORST_BITS, events=True)

    def refusal(self, craft: str) -> str | None:
        """Why this does not fit on a bus, in one line; None if it does."""
        if self.worst_percent <= LIMIT_PERCENT:
            return None
        return (
            f"{craft}: the bus would overflow: {self.frames(True)} frames of up to {WORST_BITS} bits every "
            f"{self.interval_s:g} s are {self.worst_percent:.0f} % of 1 Mbit/s; allowed "
            f"{LIMIT_PERCENT:.0f} % (fewer channels, or a longer epoch_interval_s)"
        )

    def table(self) -> str:
        """The budget as Markdown."""
        typical = typical_bits()
        lines = [
            "| frames of an epoch | frames | bits, typical | bits, at most |",
            "|---|---:|---:|---:|",
            *(
                f"| {r.what} | {r.frames} | {r.frames * typical:.0f} | {r.frames * WORST_BITS} |"
                for r in self.rows
            ),
        ]
        steady, all_ = self.frames(False), self.frames(True)
        lines += [
            f"| **steady** | {steady} | {steady * typical:.0f} | {steady * WORST_BITS} |",
            f"| **with every event at once** | {all_} | {all_ * typical:.0f} | {all_ * WORST_BITS} |",
            "",
            self.loads(),
        ]
        return "\n".join(lines)

    def loads(self) -> str:
        """What the frames are of the bus, in a sentence."""
        typical = typical_bits()
        return (
            f"Epoch of {self.interval_s:g} s at 1 Mbit/s: {self.load_percent(typical, False):.2f} % typical, "
            f"{self.load_percent(WORST_BITS, False):.2f} % at most in steady state, "
            f"{self.worst_percent:.2f} % with every event at once; above {LIMIT_PERCENT:.0f} % a run is "
            f"refused. A frame of eight bytes has 111 bits without stuffing, {typical:.1f} on average with "
            f"random contents, {WORST_BITS} at most."
        )


def budget(vehicle: Vehicle, interval_s: float, almanac_satellites: int, almanac_cycle_s: float) -> Budget:
    return Budget(tuple(rows(vehicle, interval_s, almanac_satellites, almanac_cycle_s)), interval_s)
