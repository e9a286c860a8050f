"""Frames of an earlier time on the bus: what does a flight software publish while a record comes back?

    python -m tests.support.replays RUN [--lags 1 16 240] [--step 7]

takes the record of a run (`bus.log`, `truth.parquet`), replaces frames of sixty epochs by those of `lag`
epochs earlier, as they were, CRC and counter with them, under time marks that are fresh, and plays it to the
flight software. A fix is *false* if it is farther from the truth than five of its own sigmas, along any axis
of its covariance. Reads logs by itself; the flight software is all it takes from the bench.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from gnss_hil.dbc.common.vehicle import find, load
from gnss_hil.dbc.contract.frames import FrameBatch, batch
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.state import FlightState, initial_state
from gnss_hil.flightsw.app.step import flight_step
from tests.support.feeder import Frame, recorded

FIRST, EPOCHS = 500, 60
"""Epoch of the first fault, and how many are faulty."""

FARTHEST_SIGMA = 5.0

MEASUREMENTS = range(0x100, 0x180)
ALMANAC = range(0x400, 0x480)
ATTITUDE = (0x060, 0x061, 0x062)


def is_measurement(can_id: int) -> bool:
    """Of a channel, or the ionosphere: not a receiver's tag and status."""
    return can_id in MEASUREMENTS and can_id % 16 < 0xC


def of_receivers(can_id: int) -> bool:
    return can_id in MEASUREMENTS or can_id in ALMANAC or 0x701 <= can_id <= 0x708


STREAMS: dict[str, Callable[[int], bool]] = {
    "measurements, almanac": lambda i: is_measurement(i) or i in ALMANAC,
    "measurements, almanac, attitude": lambda i: is_measurement(i) or i in ALMANAC or i in ATTITUDE,
    "measurements": is_measurement,
    "attitude": lambda i: i in ATTITUDE,
    "receivers whole": of_receivers,
    "all but the mark": lambda i: i > 0x012,
    "receiver 2": lambda i: is_measurement(i) and i >> 4 == 0x11,
    "receiver 2 whole, attitude": lambda i: (
        (of_receivers(i) and (i >> 4 in (0x11, 0x41) or i == 0x702)) or i in ATTITUDE
    ),
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """Of the faulty epochs: fixes, those that are false, the largest error [m] and in its own sigmas."""

    fixes: int
    false: int
    worst_m: float
    worst_sigma: float


def replaced(
    epochs: Sequence[Sequence[Frame]], number: int, lag: int, which: Callable[[int], bool]
) -> list[Frame]:
    """An epoch's frames, those that `which` names being of `lag` epochs earlier."""
    kept = [frame for frame in epochs[number] if not which(frame[0])]
    old = [frame for frame in epochs[number - lag] if which(frame[0])]
    # By identifier, as a bus has them; heartbeats close a node's block.
    return sorted(kept + old, key=lambda frame: frame[0])


def as_batch(frames: Sequence[Frame]) -> FrameBatch:
    can_id = np.array([frame[0] for frame in frames], np.uint32)
    data = np.frombuffer(b"".join(frame[1] for frame in frames), np.uint8).reshape(-1, 8)
    return batch(can_id, data)


class Judge:
    """A run's record and its truth."""

    def __init__(self, run: Path, vehicle: str = "soyuz-ms", policy: str = "patent", **options: object):
        self.epochs = recorded(run / "bus.log")
        truth = pl.read_parquet(run / "truth.parquet")
        self.truth_m = truth.select("x_ecef_m", "y_ecef_m", "z_ecef_m").to_numpy()
        self.config = configure(load(find(vehicle)), policy, options)
        self._states: dict[int, FlightState] = {}

    def begin(self, number: int) -> FlightState:
        """The flight software's state before an epoch."""
        if number not in self._states:
            known = max((k for k in self._states if k < number), default=0)
            state = self._states.get(known) or initial_state(self.config)
            for frames in self.epochs[known:number]:
                state, _ = flight_step(self.config, state, as_batch(frames))
            self._states[number] = state
        return self._states[number]

    def played(self, faulty: Iterator[tuple[int, Sequence[Frame]]], first: int) -> Outcome:
        """Faulty epochs, by number."""
        state, fixes, false, worst_m, worst_sigma = self.begin(first), 0, 0, 0.0, 0.0
        for number, frames in faulty:
            state, _ = flight_step(self.config, state, as_batch(frames))
            fix = state.solution.fix
            if fix is None:
                continue
            error = fix.position_m - self.truth_m[number]
            sigmas = float(np.sqrt(error @ np.linalg.solve(fix.covariance_m2, error)))
            fixes, false = fixes + 1, false + (sigmas > FARTHEST_SIGMA)
            worst_m, worst_sigma = max(worst_m, float(np.linalg.norm(error))), max(worst_sigma, sigmas)
        return Outcome(fixes, false, worst_m, worst_sigma)

    def replay(
        self, lag: int, which: Callable[[int], bool], first: int = FIRST, epochs: int = EPOCHS
    ) -> Outcome:
        numbers = range(first, first + epochs)
        return self.played(((k, replaced(self.epochs, k, lag, which)) for k in numbers), first)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("run", type=Path)
    parser.add_argument("--lags", type=int, nargs="*", help="default: 1 to 480")
    parser.add_argument("--step", type=int, default=1)
    parser.add_argument("--streams", nargs="*", default=list(STREAMS))
    given = parser.parse_args(argv)
    judge, false = Judge(given.run), 0
    lags = given.lags or range(1, 481, given.step)
    for name in given.streams:
        found = [judge.replay(lag, STREAMS[name]) for lag in lags]
        false += sum(one.false for one in found)
        print(
            f"{name:34s} {len(found)} lags: {min(o.fixes for o in found)} to {max(o.fixes for o in found)} "
            f"fixes of {EPOCHS}, {sum(o.false for o in found)} false, at most "
            f"{max(o.worst_m for o in found):.1f} m, {max(o.worst_sigma for o in found):.1f} sigma",
            flush=True,
        )
    return int(false > 0)


if __name__ == "__main__":
    sys.exit(main())
