"""Epochs with two masters of time: what is on record of them has its time, and no other one."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.dbc.contract import codec, e2e
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.tools.decoder.digest import Digest

pytestmark = pytest.mark.verifies(
    "tools/decoder/doubted_times.py",
    what="The time of epochs whose time frames are refused by their counters",
    by="blocks with marks of two masters in any order and in pieces of any size, times put in",
    status="validated",
)

CODEC = codec.codec(4)
WEEK, SECOND = 1712, 604_790
"""The week ends among the epochs."""
EPOCHS = 24


def mark(epoch, ahead_s=0, counter=None, kinds=("TIME_MARK", "TIME_GPS", "TIME_FINE"), interval_s=1):
    week, second = divmod(WEEK * 604_800 + SECOND + interval_s * epoch + ahead_s, 604_800)
    values = {
        "TIME_MARK": {"session": 1, "epoch": epoch},
        "TIME_GPS": {"week": week, "second": second},
        "TIME_FINE": {"nanosecond": 250_000_000, "leap": 16, "mark_clock": 0},
    }
    frames = [batch([CODEC.can_id_of[kind, 0]], CODEC.encode(kind, values[kind], 1)) for kind in kinds]
    sent = np.full(CODEC.streams, ((epoch if counter is None else counter) - 1) % 15, np.int8)
    return e2e.protect(CODEC, concat(frames), sent, epoch)[0]


def answer(epoch) -> FrameBatch:
    frames = batch([CODEC.can_id_of["NAV_STATUS", 0]], CODEC.encode("NAV_STATUS", {"mode": 0}, 1))
    return e2e.protect(CODEC, frames, np.full(CODEC.streams, (epoch - 1) % 15, np.int8), epoch)[0]


def times(blocks, piece=10**6):
    """Second since the first epoch of every NAV_STATUS on record, by its epoch."""
    digest, frames = Digest(CODEC), concat(blocks)
    for i in range(0, len(frames), piece):
        digest.feed(frames[i : i + piece])
    digest.finish()
    t0_ns = WEEK * NS_PER_WEEK + SECOND * NS_PER_S + NS_PER_S // 4
    fixes = digest.fixes
    return dict(zip(fixes["epoch"].tolist(), ((fixes["t_ns"] - t0_ns) / NS_PER_S).tolist(), strict=True))


def second_master(epoch, first, ahead_s=1):
    """An epoch's mark, and the time frames of another: the record leaves a second TIME_MARK out."""
    own, other = mark(epoch), mark(epoch, ahead_s, epoch + 8, ("TIME_GPS", "TIME_FINE"))
    return concat([own[:1], other, own[1:]]) if first else concat([own, other])


@pytest.mark.parametrize("first", [False, True], ids=["behind", "before"])
@pytest.mark.parametrize("piece", [1, 7, 10**6])
@pytest.mark.parametrize("ahead_s", [1, -1, 604_800])
def test_every_epoch_has_its_own_time(first, piece, ahead_s):
    faulty = range(5, 16)
    blocks = [
        concat([second_master(e, first, ahead_s) if e in faulty else mark(e), answer(e)])
        for e in range(EPOCHS)
    ]
    assert times(blocks, piece) == {e: float(e) for e in range(EPOCHS)}


def test_a_time_that_does_not_follow_is_none():
    """Two that are both wrong, and one that is alone and wrong."""
    gps, fine = ("TIME_GPS",), ("TIME_FINE",)
    for wrong in (
        [mark(5)[:1], mark(5, 7, 13, gps), mark(5, 9, 4, gps), mark(5, 0, 13, fine)],
        [mark(5)[:1], mark(5, 7, 13, gps), mark(5, 0, 13, fine)],
        [mark(5)[:1], mark(5, 0, 13, fine)],
    ):
        blocks = [concat([*(wrong if e == 5 else [mark(e)]), answer(e)]) for e in range(12)]
        assert 5 not in times(blocks) and times(blocks)[4] == 4.0 and times(blocks)[11] == 11.0


def test_before_two_epochs_are_known_nothing_is_expected():
    blocks = [concat([second_master(e, first=True), answer(e)]) for e in range(4)]
    assert set(times(blocks)) <= {0}


def test_after_a_gap_the_time_is_reckoned_by_the_number():
    blocks = [concat([mark(e), answer(e)]) for e in (0, 1, 2)]
    blocks += [concat([mark(e)[:1], mark(e, 0, e + 7, ("TIME_GPS", "TIME_FINE")), answer(e)]) for e in (4, 7)]
    assert times(blocks) == {0: 0.0, 1: 1.0, 2: 2.0, 4: 4.0, 7: 7.0}
