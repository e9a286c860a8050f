"""One signal of one measurement frame altered under a valid CRC, bit by bit: what is published of it?

    python -m tests.support.masquerades RUN [--satellites 4 5 6 8 12 24]

takes the record of a run, leaves so many satellites of it, lets the flight software settle, and then plays
one epoch again and again with one bit of one frame of one channel turned and the CRC made right. A fix that
calls itself tested and is farther than 5.33 of its own sigmas from the truth is a failure; others are
counted.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from gnss_hil.flightsw.app.step import flight_step
from tests.support.feeder import Frame, protection
from tests.support.replays import Judge, as_batch, is_measurement

FIRST, SETTLED = 400, 60
"""Epoch from which on only some satellites are there, and how many later one is altered."""

FARTHEST_SIGMA = 5.33


def channel_of(frame: Frame) -> tuple[int, int]:
    """Receiver and channel of a measurement frame."""
    return frame[0] >> 4 & 0xF, frame[1][2] & 0x1F


def fewer(frames: Sequence[Frame], channels: set[tuple[int, int]]) -> list[Frame]:
    """Measurements of these channels alone."""
    return [f for f in frames if not is_measurement(f[0]) or f[0] % 16 > 9 or channel_of(f) in channels]


def altered(frame: Frame, bit: int) -> Frame:
    data = bytearray(frame[1])
    data[bit // 8] ^= 1 << bit % 8
    data[0] = protection(frame[0], bytes(data))
    return frame[0], bytes(data)


def variants(
    frames: Sequence[Frame], channels: set[tuple[int, int]], step: int
) -> Iterator[tuple[str, list[Frame]]]:
    """What was altered, and the epoch's frames."""
    for place, frame in enumerate(frames):
        if is_measurement(frame[0]) and frame[0] % 16 <= 9 and channel_of(frame) in channels:
            for bit in range(8, 64, step):
                yield f"{frame[0] % 16}:{bit}", [*frames[:place], altered(frame, bit), *frames[place + 1 :]]


def sweep(judge: Judge, satellites: int, step: int = 1, first: int = FIRST) -> Counter:
    """Outcomes of all alterations where so many satellites are left, which channels take turns in."""
    every = sorted(
        {channel_of(f) for f in judge.epochs[first + SETTLED] if is_measurement(f[0]) and f[0] % 16 == 9}
    )
    by_turns = sorted(every, key=lambda rc: (rc[1], rc[0]))
    channels = set(by_turns[:satellites])
    state = judge.begin(first)
    for k in range(first, first + SETTLED):
        state, _ = flight_step(judge.config, state, as_batch(fewer(judge.epochs[k], channels)))
    number, found = first + SETTLED, Counter()
    for what, frames in variants(fewer(judge.epochs[number], channels), channels, step):
        solution = flight_step(judge.config, state, as_batch(frames))[0].solution
        fix = solution.fix
        if fix is None:
            found["no fix"] += 1
            found[f"  {what} {solution.reason.name}"] += 1
            continue
        error = fix.position_m - judge.truth_m[number]
        far = error @ np.linalg.solve(fix.covariance_m2, error) > FARTHEST_SIGMA**2
        found[fix.tested.name.lower() + (", false" if far else "")] += 1
        if far:
            found[f"  {what} {np.linalg.norm(error):.0f} m"] += 1
    return found


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("run", type=Path)
    parser.add_argument("--satellites", type=int, nargs="*", default=[4, 5, 6, 7, 8, 10, 12, 16, 24])
    parser.add_argument("--step", type=int, default=1, help="every so many bits")
    given = parser.parse_args(argv)
    judge, false = Judge(given.run), 0
    for satellites in given.satellites:
        found = sweep(judge, satellites, given.step)
        false += found["tested, false"]
        print(satellites, dict(found.most_common(14)), flush=True)
    return int(false > 0)


if __name__ == "__main__":
    sys.exit(main())
