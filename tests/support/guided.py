"""Frames that a fuzzer finds by what they reach in the code: a flight software and a record, fed by atheris.

    pip install atheris
    python -m tests.support.guided RUN -len_control=0 -max_len=400 -max_total_time=600 [CORPUS]

Octets are taken as edits of one epoch of the run's record (a frame's octet, its whole data, an identifier, a
frame more, less, twice, or one of before; the CRC made right again or not), played from a flight state that
tracks, then sound epochs behind it. An exception ends it, as does a fix that calls itself tested and is
farther than 5.33 of its own sigmas from the truth; the octets stay in a file. Words that begin with `-` are
libFuzzer's.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from gnss_hil.flightsw.records.solution import SnapshotFix, Tested
from tests.support.feeder import Frame, protection

FARTHEST_SIGMA = 5.33

EDITED = (70, 75)
"""Epochs of the record: edited ones are among these."""


def edits(octets: bytes) -> Iterator[tuple[int, int, bool, bytes]]:
    """Kind, place, whether the CRC is made right, and data of each edit, of 12 octets; the rest is left."""
    for start in range(0, len(octets) - 11, 12):
        word = octets[start : start + 12]
        yield word[0] & 7, int.from_bytes(word[1:3], "little"), bool(word[0] & 8), word[3:]


def sound(frame: Frame) -> Frame:
    can_id, data = frame
    return can_id, bytes([protection(can_id, data)]) + data[1:]


def _octet(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    can_id, said = frames[at]
    place = data[0] % 8
    frames[at] = can_id, said[:place] + data[1:2] + said[place + 1 :]
    return at


def _data(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    can_id, said = frames[at]
    frames[at] = can_id, said[:2] + data[2:8]  # header as it was: past the counter
    return at


def _identifier(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    frames[at] = int.from_bytes(data[:2], "little") & 0x7FF, frames[at][1]
    return at


def _more(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    frames.insert(at, (frames[at][0], data[:8]))
    return at


def _less(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    del frames[at : at + 1 + data[0] % 16]
    return max(min(at, len(frames) - 1), 0)


def _twice(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    frames.insert((at + data[0]) % len(frames), frames[at])
    return at


def _before(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    frames[at] = old[at % len(old)]
    return at


def _none(frames: list[Frame], at: int, data: bytes, old: Sequence[Frame]) -> int:
    return at


EDITS: tuple[Callable[[list[Frame], int, bytes, Sequence[Frame]], int], ...] = (
    *(_octet, _data, _identifier, _more, _less, _twice, _before, _none),
)
"""By the lowest three bits of an edit; each says where the frame is whose CRC may be made right."""


def edited(frames: Sequence[Frame], old: Sequence[Frame], octets: bytes) -> list[Frame]:
    """An epoch's frames, changed as the octets say; `old` are those of an epoch before."""
    out = list(frames)
    for kind, place, right, data in edits(octets):
        if not out:
            break
        at = EDITS[kind](out, place % len(out), data, old)
        if right and out:
            out[at] = sound(out[at])
    return out


def believed(fix: SnapshotFix | None, truth_m: np.ndarray) -> None:
    """A fix, if there is one, is not false when it calls itself tested."""
    if fix is None or fix.tested is not Tested.TESTED:
        return
    error_m = fix.position_m - truth_m
    if error_m @ np.linalg.solve(fix.covariance_m2, error_m) > FARTHEST_SIGMA**2:
        raise AssertionError(f"a tested fix is {np.linalg.norm(error_m):.0f} m off")


def one_input(run: Path) -> Callable[[bytes], None]:
    """What takes a fuzzer's octets: the flight software, the record, the monitor's text.

    Imports here: atheris watches what is imported while it says so.
    """
    from gnss_hil.dbc.contract.codec import codec
    from gnss_hil.flightsw.app.step import flight_step
    from gnss_hil.tools.decoder.screen import Screen
    from gnss_hil.tools.monitor.format import Formatter
    from gnss_hil.tools.monitor.lines import Decoded, Piece
    from gnss_hil.tools.recording.sequence import Sequencer
    from tests.support.replays import Judge, as_batch

    judge, contract = Judge(run), codec(4)
    states = [judge.begin(number) for number in range(*EDITED)]

    def take(octets: bytes) -> None:
        which = octets[0] % len(states) if octets else 0
        number = EDITED[0] + which
        frames = edited(judge.epochs[number], judge.epochs[number - 1 - which], octets[1:])
        state, _ = flight_step(judge.config, states[which], as_batch(frames))
        believed(state.solution.fix, judge.truth_m[number])
        for later in (number + 1, number + 2):
            state, _ = flight_step(judge.config, state, as_batch(judge.epochs[later]))
            believed(state.solution.fix, judge.truth_m[later])
        heard = as_batch(frames)
        sequencer = Sequencer(contract, bool(which % 2))
        for epoch in (*sequencer.hear(heard), *sequencer.finish()):
            Screen(contract).take(epoch.frames)
        Decoded(Formatter(contract))(Piece(0, heard, Screen(contract).take(heard).verdict))

    return take


def main(argv: Sequence[str] | None = None) -> int:
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or words[0].startswith("-"):
        print(f"{(__doc__ or '').splitlines()[2].strip()}: RUN is missing", file=sys.stderr)
        return 2
    try:
        import atheris  # pyright: ignore[reportMissingImports]
    except ImportError:
        print("tests.support.guided: needs atheris: pip install atheris", file=sys.stderr)
        return 2
    with atheris.instrument_imports(include=["gnss_hil"]):
        take = one_input(Path(words[0]))
    atheris.Setup([sys.argv[0], *words[1:]], take)
    atheris.Fuzz()
    return 0


if __name__ == "__main__":
    sys.exit(main())
