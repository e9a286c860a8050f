"""Time marks that jump, and blocks that come late: is any believed?

    python -m tests.support.time_jumps RUN

takes the record of a run and plays thirty epochs whose marks are off by a time, from 10 ms to 1,024 weeks,
once or for good, and thirty whose whole blocks, marks with them, are of an earlier epoch. No fix may be
published of an epoch whose mark is wrong, and each must be told as one without time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.records.solution import NoFix
from tests.support.feeder import Frame, protection
from tests.support.replays import Judge, as_batch

FIRST, EPOCHS = 400, 30
WEEK_S = 604_800
JUMPS_S = (
    *(0.01, 0.02, 0.1, 0.5, 1.0, 2.0, 16.0, 18.0, 60.0, 1200.0, 3600.0, 86_400.0),
    *(float(WEEK_S), 512.0 * WEEK_S, 1024.0 * WEEK_S, 1023.0 * WEEK_S),
)
LAGS = (1, 2, 3, 5, 15, 16, 30, 60, 120, 239, 240, 241, 300, 399)


@dataclass(frozen=True, slots=True)
class Outcome:
    """believed: fixes of epochs whose mark is wrong; untold: those not called epochs without a time"""

    believed: int
    untold: int


def sealed(frame: Frame, word: int) -> Frame:
    data = bytearray(word.to_bytes(8, "little"))
    data[0] = protection(frame[0], bytes(data))
    return frame[0], bytes(data)


def jumped(frames: Sequence[Frame], jump_s: float) -> list[Frame]:
    """An epoch's frames, its mark being later."""
    by_id = {f[0]: int.from_bytes(f[1], "little") for f in frames if f[0] in (0x011, 0x012)}
    week, second, nano = (
        by_id[0x011] >> 16 & 0xFFFF,
        by_id[0x011] >> 32 & 0xFFFFF,
        by_id[0x012] >> 16 & (1 << 30) - 1,
    )
    total = (week * WEEK_S + second) * 10**9 + nano + round(jump_s * 1e9)
    seconds, nano = divmod(total, 10**9)
    week, second = divmod(seconds, WEEK_S)
    words = {
        0x011: by_id[0x011] & ~(0xFFFFFFFFF << 16) | week << 16 | second << 32,
        0x012: by_id[0x012] & ~((1 << 30) - 1 << 16) | nano << 16,
    }
    return [sealed(f, words[f[0]]) if f[0] in words else f for f in frames]


def old(judge: Judge, number: int, lag: int) -> Sequence[Frame] | None:
    """The block of an earlier epoch that was played before; one that merely comes late is sound."""
    return judge.epochs[number - lag] if number - lag < FIRST else None


def outcome(judge: Judge, faulty: Callable[[int], Sequence[Frame] | None]) -> Outcome:
    """Of epochs whose frames `faulty` gives, where it gives some; others are as recorded."""
    state, believed, untold = judge.begin(FIRST), 0, 0
    for k in range(FIRST, FIRST + EPOCHS):
        frames = faulty(k)
        state, _ = flight_step(judge.config, state, as_batch(judge.epochs[k] if frames is None else frames))
        if frames is not None:
            believed += state.solution.fix is not None
            untold += state.solution.reason is not NoFix.NO_TIME_MARK
    return Outcome(believed, untold)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("run", type=Path)
    judge, bad = Judge(parser.parse_args(argv).run), 0
    signed = [sign * jump for jump in JUMPS_S for sign in (1, -1)]
    for name, shapes in (
        (
            "once",
            {f"{s:+g} s": lambda k, s=s: jumped(judge.epochs[k], s) if k == FIRST else None for s in signed},
        ),
        ("for good", {f"{s:+g} s": lambda k, s=s: jumped(judge.epochs[k], s) for s in signed}),
        ("block of", {f"{n} epochs before": lambda k, n=n: old(judge, k, n) for n in LAGS}),
    ):
        for shape, faulty in shapes.items():
            found = outcome(judge, faulty)
            bad += found.believed + found.untold
            if found.believed or found.untold:
                print(f"{name} {shape}: {found.believed} believed, {found.untold} untold", flush=True)
        print(f"{name}: {len(shapes)} played")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
