"""Ranges off by a step or a ramp, of a channel, a satellite or a receiver: is there a fix, and is it right?

    python -m tests.support.steps RUN [--satellites 12 22] [--trials 40]

takes the record of a run, leaves so many satellites of it, and plays twenty epochs in which pseudoranges of a
satellite, two, or a receiver are longer by metres. A fix is *missed* if it calls itself tested and is farther
than 5.33 of its own sigmas from the truth.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.records.solution import Tested
from tests.support.feeder import Frame, protection
from tests.support.masquerades import FARTHEST_SIGMA, channel_of, fewer
from tests.support.replays import Judge, as_batch, is_measurement

FIRST, SETTLED, EPOCHS = 300, 60, 20

STEPS_M = (15.0, 20.0, 30.0, 50.0, 100.0, 200.0, 500.0, -30.0, -100.0)
RAMPS_MPS = (0.2, 1.0, 5.0, 20.0)

Suspects = Callable[[dict[tuple[int, int], int], np.random.Generator], set[tuple[int, int]]]


def _satellites(of: dict[tuple[int, int], int], rng: np.random.Generator, count: int) -> set[tuple[int, int]]:
    chosen = rng.choice(sorted(set(of.values())), count, replace=False)
    return {channel for channel, sat in of.items() if sat in chosen}


def _receiver(of: dict[tuple[int, int], int], rng: np.random.Generator) -> set[tuple[int, int]]:
    receiver = rng.choice(sorted({r for r, _ in of}))
    return {channel for channel in of if channel[0] == receiver}


PLACES: dict[str, Suspects] = {
    "satellite": lambda of, rng: _satellites(of, rng, 1),
    "two satellites": lambda of, rng: _satellites(of, rng, 2),
    "receiver": _receiver,
}


@dataclass(frozen=True, slots=True)
class Outcome:
    epochs: int
    fixes: int
    false: int
    missed: int
    worst_m: float


def longer(frame: Frame, metres: float) -> Frame:
    """A RANGE frame with its pseudorange longer, its CRC right."""
    word = int.from_bytes(frame[1], "little")
    raw = (word >> 21 & (1 << 42) - 1) + round(metres / 1e-4)
    word = word & ~((1 << 42) - 1 << 21) | raw << 21
    data = bytearray(word.to_bytes(8, "little"))
    data[0] = protection(frame[0], bytes(data))
    return frame[0], bytes(data)


def satellites_of(frames: Sequence[Frame]) -> dict[tuple[int, int], int]:
    """Satellite by receiver and channel, from SV_CLOCK."""
    found = {}
    for frame in frames:
        if is_measurement(frame[0]) and frame[0] % 16 == 9:
            found[channel_of(frame)] = int.from_bytes(frame[1], "little") >> 21 & 0x1FF
    return found


def play(
    judge: Judge,
    first: int,
    channels: set,
    suspects: set,
    metres: Callable[[int], float],
    epochs: int = EPOCHS,
) -> Outcome:
    state = judge.begin(first - SETTLED)
    for k in range(first - SETTLED, first):
        state, _ = flight_step(judge.config, state, as_batch(fewer(judge.epochs[k], channels)))
    fixes = false = missed = 0
    worst_m = 0.0
    for k in range(first, first + epochs):
        frames = [
            longer(f, metres(k - first))
            if is_measurement(f[0]) and f[0] % 16 == 0 and channel_of(f) in suspects
            else f
            for f in fewer(judge.epochs[k], channels)
        ]
        state, _ = flight_step(judge.config, state, as_batch(frames))
        fix = state.solution.fix
        if fix is None:
            continue
        error = fix.position_m - judge.truth_m[k]
        far = bool(error @ np.linalg.solve(fix.covariance_m2, error) > FARTHEST_SIGMA**2)
        fixes, false, missed = fixes + 1, false + far, missed + (far and fix.tested is Tested.TESTED)
        worst_m = max(worst_m, float(np.linalg.norm(error)))
    return Outcome(epochs, fixes, false, missed, worst_m)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("run", type=Path)
    parser.add_argument("--satellites", type=int, nargs="*", default=[12, 22])
    parser.add_argument("--trials", type=int, default=10, help="of each size and place")
    given = parser.parse_args(argv)
    judge, rng, missed = Judge(given.run), np.random.default_rng(1), 0
    shapes = [(f"{s:+g} m", lambda k, s=s: s) for s in STEPS_M] + [
        (f"{r:g} m/s", lambda k, r=r: r * k) for r in RAMPS_MPS
    ]
    for satellites in given.satellites:
        for place, choose in PLACES.items():
            for shape, metres in shapes:
                found = []
                for _ in range(given.trials):
                    first = int(rng.integers(FIRST, len(judge.epochs) - EPOCHS))
                    of = satellites_of(judge.epochs[first])
                    by_turns = sorted(of, key=lambda rc: (rc[1], rc[0]))[:satellites]
                    of = {rc: of[rc] for rc in by_turns}
                    found.append(play(judge, first, set(by_turns), choose(of, rng), metres))
                n = sum(o.epochs for o in found)
                missed += sum(o.missed for o in found)
                fixed = sum(o.fixes for o in found) / n
                print(
                    f"{satellites} satellites, {place:15s} {shape:9s} fixes {fixed:6.1%}  "
                    f"false {sum(o.false for o in found):4d}  missed {sum(o.missed for o in found)}  of {n}; "
                    f"at most {max(o.worst_m for o in found):.1f} m",
                    flush=True,
                )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
