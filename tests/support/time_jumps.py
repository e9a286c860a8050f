"""Time marks that jump, and blocks that come late: is any believed?

    python -m tests.support.time_jumps RUN

takes the record of a run and plays thirty epochs whose marks are off by a time, from 10 ms to 1,024 weeks,
once or for good, and thirty whose whole blocks, marks with them, are of an earlier epoch. No fix may be
published of an epoch whose mark is wrong, and each must be told as one without time. Then such marks come
beside the true ones, before or behind them, as another master's, whose counter is any and whose epochs may be
others too: none may be believed, each must be told, and each epoch have its fix.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
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
MARK = (0x010, 0x011, 0x012)
MASTERS = (
    *((sign * jump, 0) for jump in (0.0, 0.001, *JUMPS_S) for sign in (1, -1)),
    *((float(ahead), ahead) for ahead in (1, -1, 3, -7, 16, -16, 240)),
    *((0.0, ahead) for ahead in (1, -1, 16)),
)
"""Seconds and epochs by which another master's marks are ahead; some agree with themselves."""
OFFSETS = range(15)
"""By which its counter is."""
LAGS = (1, 2, 3, 5, 15, 16, 30, 60, 120, 239, 240, 241, 300, 399)


@dataclass(frozen=True, slots=True)
class Outcome:
    """believed: fixes of epochs whose mark is wrong; untold: those not called epochs without a time. Beside a
    true mark, believed are others, and untold also epochs without a fix."""

    believed: int
    untold: int


def sealed(frame: Frame, word: int) -> Frame:
    data = bytearray(word.to_bytes(8, "little"))
    data[0] = protection(frame[0], bytes(data))
    return frame[0], bytes(data)


def shown_ns(frames: Sequence[Frame]) -> int:
    """GPS time of the mark of an epoch's frames."""
    gps, fine = (next(int.from_bytes(f[1], "little") for f in frames if f[0] == i) for i in MARK[1:])
    week, second, nano = gps >> 16 & 0xFFFF, gps >> 32 & 0xFFFFF, fine >> 16 & (1 << 30) - 1
    return (week * WEEK_S + second) * 10**9 + nano


def jumped(frames: Sequence[Frame], jump_s: float) -> list[Frame]:
    """An epoch's frames, its mark being later."""
    by_id = {f[0]: int.from_bytes(f[1], "little") for f in frames if f[0] in (0x011, 0x012)}
    seconds, nano = divmod(shown_ns(frames) + round(jump_s * 1e9), 10**9)
    week, second = divmod(seconds, WEEK_S)
    words = {
        0x011: by_id[0x011] & ~(0xFFFFFFFFF << 16) | week << 16 | second << 32,
        0x012: by_id[0x012] & ~((1 << 30) - 1 << 16) | nano << 16,
    }
    return [sealed(f, words[f[0]]) if f[0] in words else f for f in frames]


def another_master(
    frames: Sequence[Frame], jump_s: float, ahead: int, offset: int, first: bool
) -> list[Frame]:
    """An epoch's frames, and another master's mark before or behind the true one."""
    others = []
    for can_id, data in jumped([frame for frame in frames if frame[0] in MARK], jump_s):
        word = int.from_bytes(data, "little")
        counter, nibble = ((word >> 8 & 15) + offset) % 15, ((word >> 12 & 15) + ahead) % 16
        word = word & ~(0xFF << 8) | counter << 8 | nibble << 12
        if can_id == MARK[0]:
            word = word & 0xFFFFFFFF | (word >> 32) + ahead << 32
        others.append(sealed((can_id, data), word))
    own, rest = list(frames[: len(MARK)]), frames[len(MARK) :]
    return [*others, *own, *rest] if first else [*own, *others, *rest]


def beside(judge: Judge, jump_s: float, ahead: int, offset: int, first: bool) -> Outcome:
    """With the mark of another master in every epoch. Untold are epochs too that have no fix."""
    state, believed, untold = judge.begin(FIRST), 0, 0
    true = {(k, shown_ns(judge.epochs[k])) for k in range(FIRST - 1, FIRST + EPOCHS)}
    for k in range(FIRST, FIRST + EPOCHS):
        refused = int(state.rejected[:, MARK].sum())
        frames = another_master(judge.epochs[k], jump_s, ahead, offset, first)
        state, _ = flight_step(judge.config, state, as_batch(frames))
        last = state.marks.last
        believed += last is None or (last.epoch, last.t_ns) not in true
        untold += int(state.rejected[:, MARK].sum()) == refused or state.solution.fix is None
    return Outcome(believed, untold)


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
    cases = list(product(MASTERS, OFFSETS, (False, True)))
    for (jump_s, ahead), offset, first in cases:
        found = beside(judge, jump_s, ahead, offset, first)
        bad += found.believed + found.untold
        if found.believed or found.untold:
            shape = f"{jump_s:+g} s, {ahead:+d} epochs, counter {offset:+d}, {'first' if first else 'last'}"
            print(f"beside, {shape}: {found.believed} believed, {found.untold} untold", flush=True)
    print(f"another master beside the true one: {len(cases)} played")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
