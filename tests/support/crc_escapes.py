"""What the CRC does not see of three and four turned bits: how much of it reaches a fix?

    python -m tests.support.crc_escapes RUN [--satellites 24 12 6] [--step 1]

takes the record of a run, leaves so many satellites of it, lets the flight software settle, and plays one
epoch again and again with one frame altered by each pattern of three or four bits that Profile 11's CRC-8
lets through, one frame of each kind. For each kind it counts what became of the epoch: as without it, a fix
that moved by a sigma at most, one that is right all the same, none, or one that is farther than 5.33 of its
own sigmas from the truth. One that is so and calls itself tested is a failure.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from gnss_hil.dbc.contract.codec import Codec, codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.records.solution import Tested
from tests.support.masquerades import FARTHEST_SIGMA, FIRST, SETTLED, channel_of, fewer
from tests.support.replays import Judge, as_batch, is_measurement
from tests.support.undetected import masks, undetected


def one_of_each_kind(contract: Codec, block: FrameBatch) -> dict[str, int]:
    """First row of each kind of protected frame in a block."""
    kinds = {row.number: name for name, row in contract.kinds.items()}
    first: dict[str, int] = {}
    for row, number in enumerate(contract.kind_of[block.can_id].tolist()):
        if number in kinds:
            first.setdefault(kinds[number], row)
    return first


def altered(block: FrameBatch, row: int, step: int) -> Iterator[FrameBatch]:
    for bits in (3, 4):
        for mask in masks(undetected(bits))[::step]:
            data = block.data.copy()
            data[row] ^= mask
            yield FrameBatch(block.t_ns, block.can_id, block.length, data)


def sweep(judge: Judge, satellites: int, step: int = 1, first: int = FIRST) -> dict[str, Counter[str]]:
    """What became of the epoch, by kind of the frame that was altered."""
    number = first + SETTLED
    every = {channel_of(f) for f in judge.epochs[number] if is_measurement(f[0]) and f[0] % 16 == 9}
    channels = set(sorted(every, key=lambda rc: (rc[1], rc[0]))[:satellites])
    state = judge.begin(first)
    for k in range(first, number):
        state, _ = flight_step(judge.config, state, as_batch(fewer(judge.epochs[k], channels)))
    block = as_batch(fewer(judge.epochs[number], channels))
    undisturbed = flight_step(judge.config, state, block)[0].solution.fix
    found: dict[str, Counter[str]] = {}
    for kind, row in one_of_each_kind(codec(4), block).items():
        found[kind] = Counter()
        for frames in altered(block, row, step):
            fix = flight_step(judge.config, state, frames)[0].solution.fix
            found[kind][_outcome(fix, undisturbed, judge.truth_m[number])] += 1
    return found


def _outcome(fix, undisturbed, truth_m: np.ndarray) -> str:
    if fix is None:
        return "no fix"
    moved, error = fix.position_m - undisturbed.position_m, fix.position_m - truth_m
    sigmas = [float(np.sqrt(v @ np.linalg.solve(fix.covariance_m2, v))) for v in (moved, error)]
    if sigmas[1] > FARTHEST_SIGMA:
        return "false though tested" if fix.tested is Tested.TESTED else "false"
    return "as without it" if sigmas[0] == 0 else "moved, below a sigma" if sigmas[0] < 1 else "moved, right"


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--satellites", type=int, nargs="*", default=[24, 12, 6])
    parser.add_argument("--step", type=int, default=1, help="every so many patterns")
    given = parser.parse_args(argv)
    judge, failures = Judge(given.run), 0
    for satellites in given.satellites:
        whole: Counter[str] = Counter()
        for kind, counts in sweep(judge, satellites, given.step).items():
            print(f"{satellites} satellites, {kind:14s}", dict(counts), flush=True)
            whole += counts
        print(f"{satellites} satellites, all kinds    ", dict(whole), flush=True)
        failures += whole["false though tested"]
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
