"""CRC, counter and epoch behind a fault, judged by AUTOSAR's library and by the contract's own screening."""

from __future__ import annotations

import e2e.p11 as library
import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.emulator.faults.files import of_line
from gnss_hil.emulator.faults.models import FaultError
from tests.support.faulted import CODEC, all_sound, of_kind, strike

pytestmark = pytest.mark.verifies(
    "emulator/faults/protect.py",
    what="Faults: CRC and counter, in a fault and behind it",
    by="the library autosar-e2e (CRCs, and its check of counters)",
    status="validated",
)

FIRST, LAST = 100, 104
WINDOW = f"@{FIRST}..{LAST}"


def stream(line: str, first: int = FIRST - 2, last: int = LAST + 4) -> np.ndarray:
    """Payloads (e, 8) of receiver 1, channel 0, RANGE in some epochs, behind a fault."""
    rows = [of_kind(one.block, "RANGE") for one in strike(line)[first:last]]
    return np.concatenate([frames.data[frames.can_id == CODEC.can_id_of["RANGE", 1]][:1] for frames in rows])


def counters(data: np.ndarray) -> list[int]:
    return (data[:, 1] & 15).tolist()


def valid(data: np.ndarray) -> list[bool]:
    can_id = CODEC.can_id_of["RANGE", 1]
    theirs = [bytearray(row.tobytes()) for row in data]
    for row in theirs:
        library.e2e_p11_protect(row, can_id, increment_counter=False)
    return [ours[0] == row[0] for ours, row in zip(data, theirs, strict=True)]


UNTOUCHED = stream("ATT loss @500")


@pytest.mark.parametrize(
    ("crc", "expected"),
    [
        ("recompute", [True] * 4),
        ("wrong", [False] * 4),
        ("keep", [False] * 4),
        ("offset crc_by=1", [False] * 4),
    ],
)
def test_crc_by_its_way(crc, expected):
    data = stream(f"rx1 ch0 RANGE.pseudorange_m += 30 crc={crc} {WINDOW}")
    assert valid(data) == [True] * 2 + expected + [True] * 4
    assert counters(data) == counters(UNTOUCHED)


def test_a_crc_that_is_set_and_one_that_freezes():
    assert stream(f"rx1 crc value by=170 {WINDOW}")[2:6, 0].tolist() == [0xAA] * 4
    frozen = stream(f"rx1 crc freeze {WINDOW}")
    assert frozen[2:6, 0].tolist() == [UNTOUCHED[2, 0]] * 4
    assert valid(frozen)[2:6] == [True, False, False, False]


@pytest.mark.parametrize(
    ("way", "expected"),
    [
        ("freeze", lambda own: [own[0]] * 4),
        ("value by=3", lambda own: [3] * 4),
        ("offset by=2", lambda own: [(c + 2) % 15 for c in own]),
        ("wrong", lambda own: [(c + 7) % 15 for c in own]),
    ],
)
def test_counter_by_its_way_under_a_valid_crc(way, expected):
    data = stream(f"rx1 counter {way} {WINDOW}")
    assert counters(data)[2:6] == expected(counters(UNTOUCHED)[2:6])
    assert all(valid(data))
    assert (data[[0, 1, 6, 7, 8, 9]] == UNTOUCHED[[0, 1, 6, 7, 8, 9]]).all()


@pytest.mark.parametrize(
    ("after", "follows"),
    [("correct", lambda own, sent: own[6]), ("last-valid", lambda own, sent: (own[1] + 1) % 15),
     ("last-value", lambda own, sent: (sent[5] + 1) % 15)],
)  # fmt: skip
def test_what_comes_after(after, follows):
    data = stream(f"rx1 counter value by=11 after={after} {WINDOW}")
    sent = counters(data)
    first = follows(counters(UNTOUCHED), sent)
    assert sent[6:] == [(first + k) % 15 for k in range(4)]
    assert all(valid(data)), "counters that go on from elsewhere are under valid CRCs"


def test_where_nothing_valid_came_before_counters_are_the_senders():
    struck = strike("ATT counter value by=11 after=last-valid @..5", epochs=10)
    own, sent = (
        counters(np.concatenate([of_kind(frames, "ATT_Q01").data for frames in side]))
        for side in ([one.before for one in struck], [one.block for one in struck])
    )
    assert sent == [11] * 5 + own[5:] and own[5] != 0


def test_frames_that_are_cut_short_have_no_header():
    short = "rx1 RANGE length 4 @100+4"
    for alone, both in zip(strike(short), strike(short, "rx1 RANGE crc wrong @100+4"), strict=True):
        assert np.array_equal(alone.block.data, both.block.data)


def test_a_replay_with_the_header_of_today_passes_every_check():
    struck = strike("rx2 replay 20 @110+10 counter=recompute epoch=recompute crc=recompute")
    heard = e2e.fresh_counters(CODEC)
    for epoch, one in enumerate(struck):
        screened = screening.screen(CODEC, one.block, heard)
        heard = screened.counters
        ranges = of_kind(one.block, "RANGE")
        if 110 <= epoch < 120:
            assert all_sound(ranges)
            assert set((ranges.data[:, 1] >> 4).tolist()) == {epoch % 16}
            rows = np.isin(one.block.can_id, [CODEC.can_id_of["RANGE", 2]])
            assert set(screened.verdict[rows].tolist()) <= {Verdict.OK}


def test_a_word_that_is_no_protection():
    with pytest.raises(FaultError, match="crc: input should be 'keep'"):
        of_line("rx1 RANGE.pseudorange_m += 3 crc=recompte")
