"""Which frames are used: refused ones leave no trace in the counters; streams are judged by their past."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.e2e_state import State, limits
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.dbc.contract.messages import KIND_BY_NAME
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.io.decode import decode
from gnss_hil.flightsw.io.frame_statistics import Reason, Rejections, no_rejections
from gnss_hil.flightsw.io.reception import MOST_SETTLED, nothing_received, receive
from tests.support import synthetic_epochs as s
from tests.support.fixes import craft
from tests.support.flown import CODEC, FakeBus, frames

pytestmark = pytest.mark.verifies(
    "flightsw/io/reception.py",
    what="Reception: order of the checks, states of streams",
    by="rules of docs/contract.md; sound blocks of a synthetic bus with faults put in",
    status="validated",
)

USUAL = limits(Protection())
STRICT = limits(
    Protection(
        window_size=6, min_ok_state_valid=3, min_ok_state_init=3, min_ok_state_invalid=4,
        max_error_state_valid=2, max_error_state_init=2, max_error_state_invalid=1, use_state_init=False,
    )
)  # fmt: skip
EPOCHS = 20


@pytest.fixture(scope="module")
def blocks():
    """Consecutive blocks of 24 channels, all nodes alive."""
    bus = FakeBus(craft(), s.constellation(), nodes=(9, 10))
    return [bus.block(k) for k in range(EPOCHS)]


def heard(blocks, with_limits=USUAL):
    """What is received of each block, and the reasons counted in it."""
    state, found = nothing_received(CODEC), []
    for block in blocks:
        counts = Rejections(no_rejections())
        received = receive(CODEC, with_limits, block, state, counts)
        state = received.reception
        reasons = {r: n for r, n in enumerate(counts.counts.sum(axis=1).tolist()) if n}
        found.append((received, reasons))
    return found


def of_kind(block, kind, number=0):
    return block.can_id == CODEC.can_id_of[kind, number]


def stream(kind, number=0, key=0):
    return int(CODEC.first_stream_of[CODEC.can_id_of[kind, number]]) + key


def state_of(received, *which):
    return State(int(received.reception.states.state[stream(*which)])).name


def damaged(block, which):
    data = block.data.copy()
    data[which, 5] ^= 0x40
    return replace(block, data=data)


def resealed(block, row, byte, value):
    """With another byte 1 or the like in one row, validly protected."""
    data = block.data.copy()
    data[row, byte] = value
    data[row, 0] = e2e.crc(block.can_id[row : row + 1], data[row : row + 1])[0]
    return replace(block, data=data)


def test_sound_blocks_are_used_whole(blocks):
    for received, reasons in heard(blocks):
        assert reasons == {} and len(received.frames) == len(received.streams) > 240


def test_a_frame_of_another_epoch_does_not_move_its_counter(blocks):
    """An old frame in place of the epoch's own: the next one is in sequence, and one is missing."""
    row = int(np.flatnonzero(of_kind(blocks[3], "RANGE", 1))[0])
    old = blocks[4].data.copy()
    old[row] = blocks[3].data[row]
    received = heard([*blocks[:4], replace(blocks[4], data=old), blocks[5]])
    assert received[4][1] == {Verdict.MIXED_EPOCH: 1}
    before, after = received[3][0].reception, received[4][0].reception
    moved = np.flatnonzero(before.counters == after.counters)
    assert stream("RANGE", 1, int(blocks[3].data[row, 2] & 31)) in moved
    assert received[5][1] == {Verdict.LOST: 1} and len(received[5][0].frames) == len(blocks[5])


@pytest.mark.parametrize("lag", range(1, 16))
def test_a_window_of_old_frames_that_ends_costs_no_sound_epoch(blocks, lag):
    """Frames of `lag` epochs before in place of two epochs' own are refused; sound ones go on at once."""
    swapped = list(blocks)
    for epoch in (17, 18):
        measured = np.isin(CODEC.kind_of[blocks[epoch].can_id], [CODEC.kinds[k].number for k in ("RANGE",)])
        data = blocks[epoch].data.copy()
        data[measured] = blocks[epoch - lag].data[of_same(blocks[epoch - lag], blocks[epoch], measured)]
        swapped[epoch] = replace(blocks[epoch], data=data)
    received = heard(swapped)
    for epoch in (17, 18):
        assert received[epoch][1] == {Verdict.MIXED_EPOCH: 24}
    assert received[19][1] == {Verdict.LOST: 24} and len(received[19][0].frames) == len(blocks[19])


def of_same(block, other, which):
    """Rows of a block whose streams are those of some rows of the other."""
    streams, wanted = (CODEC.key_of(b.can_id, b.data) for b in (block, other[which]))
    return [int(np.flatnonzero(streams == each)[0]) for each in wanted]


def test_a_node_of_another_contract_does_not_move_its_counters(blocks):
    row = int(np.flatnonzero(of_kind(blocks[4], "HEARTBEAT", 2))[0])
    word = int(CODEC.encode("HEARTBEAT", {"state": 2, "contract_hash": CODEC.hash ^ 1})[0].view("<u8")[0])
    data = blocks[4].data.copy()
    data[row, 2:] = np.array([word], "<u8").view(np.uint8)[2:]
    data[row, 0] = e2e.crc(blocks[4].can_id[row : row + 1], data[row : row + 1])[0]
    received = heard([*blocks[:4], replace(blocks[4], data=data), blocks[5]])
    theirs = np.array([CODEC.sender_of[i] == "RX2" for i in blocks[4].can_id])
    assert received[4][1] == {Reason.OTHER_CONTRACT: int(theirs.sum())}
    before, after = (received[k][0].reception.counters for k in (3, 4))
    streams = CODEC.key_of(blocks[4].can_id, blocks[4].data)
    assert np.array_equal(before[streams[theirs]], after[streams[theirs]])
    assert not np.array_equal(before[streams[~theirs]], after[streams[~theirs]])
    assert received[5][1] == {Verdict.LOST: len(np.unique(streams[theirs]))}


@pytest.mark.parametrize("place", [0, 1, 40, -1])
def test_a_late_time_mark_does_not_name_the_epoch(blocks, place):
    """A copy of the mark before, behind this epoch's own: it is refused itself, and nothing else."""
    late = blocks[2][of_kind(blocks[2], "TIME_MARK")]
    place %= len(blocks[3])
    received, reasons = heard([*blocks[:3], concat([blocks[3][:place], late, blocks[3][place:]])])[-1]
    assert received.epoch == 3 and len(received.frames) == len(blocks[3])
    assert reasons == {Verdict.MIXED_EPOCH: 1}


def test_of_two_marks_in_sequence_the_last_names_the_epoch(blocks):
    received, reasons = heard([*blocks[:3], concat(blocks[3:5])])[-1]
    assert received.epoch == 4 and reasons[Verdict.MIXED_EPOCH] == len(blocks[3])
    # Three frames of one almanac stream refused are as many missing: more than the profile lets pass.
    assert reasons[Verdict.WRONG_SEQUENCE] == 3 == len(blocks[4]) - len(received.frames)
    almanac = [CODEC.kinds[kind].number for kind in ("ALM_XY", "ALM_Z", "ALM_V")]
    kinds, sent = CODEC.kind_of[received.frames.can_id], CODEC.kind_of[blocks[4].can_id]
    assert np.isin(sent, almanac).sum() - np.isin(kinds, almanac).sum() == 3


def test_without_an_intact_mark_epochs_are_not_compared_and_counters_go_on(blocks):
    mute = damaged(blocks[3], of_kind(blocks[3], "TIME_MARK"))
    received = heard([*blocks[:3], mute, blocks[4]])
    assert received[3][0].epoch == -1 and received[3][1] == {Verdict.CORRUPTED: 1}
    assert received[4][1] == {Verdict.LOST: 1}, "of the mark; all others were heard"


def test_usual_limits_use_whatever_passes_its_own_check(blocks):
    """Under faults of every kind at once, epoch after epoch."""
    rng, faulty = np.random.default_rng(3), []
    for k in range(EPOCHS):
        block = damaged(blocks[k], rng.random(len(blocks[k])) < 0.4)
        block = block[rng.random(len(block)) < 0.8]
        again = block[np.flatnonzero(rng.random(len(block)) < 0.2)]
        faulty.append(concat([block, again, blocks[k - 1][::9]]) if k else block)
    bad = set()
    for received, reasons in heard(faulty):
        assert Reason.STREAM_NOT_VALID not in reasons
        bad |= set(np.unique(received.reception.states.state).tolist())
    assert State.VALID in bad


def test_a_stream_that_is_corrupted_too_often_is_out_until_it_has_been_sound(blocks):
    """Three errors in six epochs: out; in again with four of the last six sound, one at most corrupted."""
    bad = (8, 9, 10)
    played = [damaged(b, of_kind(b, "ATT_Q01")) if k in bad else b for k, b in enumerate(blocks)]
    received = heard(played, STRICT)
    states = [state_of(each, "ATT_Q01") for each, _ in received]
    assert states == ["INIT"] * 3 + ["VALID"] * 7 + ["INVALID"] * 5 + ["VALID"] * 5
    for k, (each, reasons) in enumerate(received):
        used = bool(of_kind(each.frames, "ATT_Q01").any())
        assert used == (states[k] == "VALID" and k not in bad)
        if k == 11:
            assert reasons == {Verdict.WRONG_SEQUENCE: 1}
        elif k > 11:
            assert reasons.get(Reason.STREAM_NOT_VALID, 0) == (not used)


def test_by_the_letter_nothing_is_used_before_it_is_valid(blocks):
    received = heard(blocks[:5], STRICT)
    assert [len(each.frames) for each, _ in received[:3]] == [0, 0, 0]
    assert received[0][1] == {Reason.STREAM_NOT_VALID: len(blocks[0])}
    assert [len(each.frames) for each, _ in received[3:]] == [len(b) for b in blocks[3:5]]


def test_a_time_mark_that_is_not_used_gives_no_epoch(blocks):
    state, rejected = nothing_received(CODEC), no_rejections()
    marks = []
    for block in blocks[:4]:
        epoch, state, rejected = decode(CODEC, STRICT, block, state, rejected)
        marks.append(epoch.mark and epoch.mark.epoch)
    assert marks == [None, None, None, 3]


SILENT = ("TIME_MARK", "TIME_GPS", "ATT_Q01", "ATT_RATE", "TAG", "STATUS", "HEARTBEAT")


@pytest.mark.parametrize("kind", SILENT)
def test_silence_of_what_comes_every_epoch_is_a_status(blocks, kind):
    number = 1 if KIND_BY_NAME[kind].per else 0
    played = [b[~of_kind(b, kind, number)] if 6 <= k < 12 else b for k, b in enumerate(blocks)]
    received = heard(played, STRICT)
    states = [state_of(each, kind, number) for each, _ in received]
    # Three of six are sound until the fourth epoch of silence. The first frame after it is out of sequence;
    # with the next four there are four sound ones again.
    assert states == ["INIT"] * 3 + ["VALID"] * 6 + ["INVALID"] * 7 + ["VALID"] * 4
    other = "ATT_Q23"
    assert state_of(received[11][0], other) == "VALID"


@pytest.mark.parametrize("kind", ["RANGE", "SV_CLOCK", "ALM_XY"])
def test_silence_of_a_channel_or_of_the_almanac_is_none(blocks, kind):
    played = [b[~of_kind(b, kind, 1)] if 6 <= k < 16 else b for k, b in enumerate(blocks)]
    received = heard(played, STRICT)
    assert {state_of(each, kind, 1) for each, _ in received[3:]} == {"VALID"}
    assert Reason.STREAM_NOT_VALID not in received[-1][1]


def test_an_empty_block_is_a_check_like_any(blocks):
    received = heard([*blocks[:8], *[EMPTY] * 4], STRICT)
    assert [state_of(each, "ATT_Q01") for each, _ in received[8:]] == ["VALID"] * 3 + ["INVALID"]
    assert state_of(received[-1][0], "RANGE", 1) == "VALID"


def test_a_sound_frame_stands_for_its_stream_whatever_comes_with_it(blocks):
    """A stranger who sends garbage under a stream's name does not take it out."""
    played = []
    for block in blocks:
        mine = of_kind(block, "ATT_Q01")
        garbage = block[np.flatnonzero(mine)]
        played.append(concat([damaged(garbage, [0]), block, damaged(garbage, [0])]))
    received = heard(played, STRICT)
    assert {state_of(each, "ATT_Q01") for each, _ in received[3:]} == {"VALID"}
    assert all(reasons.get(Verdict.CORRUPTED) == 2 for _, reasons in received)


@pytest.mark.parametrize("fault", ["corrupted and repeated", "of another epoch", "of another contract"])
def test_of_refused_frames_the_worst_stands(blocks, fault):
    """Errors count against a stream, frames out of sequence only fail to count for it."""
    played = []
    for k, block in enumerate(blocks[:12]):
        mine = np.flatnonzero(of_kind(block, "ATT_Q01"))
        if k < 9:
            played.append(block)
        elif fault == "of another epoch":
            stale = replace(block, data=block.data.copy())
            stale.data[mine] = blocks[k - 1].data[np.flatnonzero(of_kind(blocks[k - 1], "ATT_Q01"))]
            played.append(stale)
        elif fault == "corrupted and repeated":
            bad = damaged(block, mine)
            bad.data[mine] = damaged(block, mine).data[mine]
            old = blocks[8][np.flatnonzero(of_kind(blocks[8], "ATT_Q01"))]
            old.data[0, 1] = old.data[0, 1] & 15 | (k % 16) << 4
            old.data[0, 0] = e2e.crc(old.can_id, old.data)[0]
            played.append(concat([bad, old]))
        else:
            beat = frames("HEARTBEAT", {"state": 2, "contract_hash": 1}, 9)
            row = int(np.flatnonzero(of_kind(block, "HEARTBEAT", 9))[0])
            foreign = block.data.copy()
            foreign[row, 2:] = beat.data[0, 2:]
            foreign[row, 0] = e2e.crc(block.can_id[row : row + 1], foreign[row : row + 1])[0]
            played.append(replace(block, data=foreign))
    received = heard(played, STRICT)
    errors = [int(np.bitwise_count(each.reception.states.error[stream("ATT_Q01")])) for each, _ in received]
    states = [state_of(each, "ATT_Q01") for each, _ in received[9:]]
    assert errors[9:] == ([0, 0, 0] if fault == "of another epoch" else [1, 2, 3])
    assert states == ["VALID", "VALID", "VALID" if fault == "of another epoch" else "INVALID"]


@pytest.mark.parametrize("with_limits", [USUAL, STRICT], ids=["usual", "strict"])
def test_settled_blocks_leave_out_nothing(blocks, with_limits):
    """With and without what is remembered of blocks that change no state."""
    rng = np.random.default_rng(11)
    bus = FakeBus(craft(), s.constellation(), nodes=(9, 10))
    played: list[FrameBatch] = []
    for k in range(90):
        block = bus.block(k)
        if 30 <= k < 36 or k == 60:
            block = damaged(block, rng.random(len(block)) < 0.5)
        played.append(block[of_kind(block, "ALM_XY", 1) == 0] if k % 3 == 0 else block)
    one, other, passed = nothing_received(CODEC), nothing_received(CODEC), 0
    for block in played:
        counts, again = Rejections(no_rejections()), Rejections(no_rejections())
        quick = receive(CODEC, with_limits, block, one, counts)
        slow = receive(CODEC, with_limits, block, replace(other, settled=frozenset()), again)
        passed += quick.streams.tobytes() in one.settled
        assert quick.frames == slow.frames and np.array_equal(quick.streams, slow.streams)
        assert np.array_equal(counts.counts, again.counts) and quick.lost == slow.lost
        one, other = quick.reception, slow.reception
        assert np.array_equal(one.counters, other.counters)
        for part in ("state", "ok", "error"):
            assert np.array_equal(getattr(one.states, part), getattr(other.states, part))
        assert len(one.settled) <= MOST_SETTLED
    assert passed > 20
