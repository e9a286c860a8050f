"""Frames that are lost, repeated, late, out of order, put in, replayed: counted and compared one by one."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import FrameBatch, concat
from tests.support.faulted import CODEC, all_sound, by_cantools, of_kind, strike, undisturbed

pytestmark = pytest.mark.verifies(
    "emulator/faults/traffic.py",
    "emulator/faults/kinds/traffic.py",
    what="Faults: frames that are lost, late, again, elsewhere or nobody's",
    by="every frame of a run counted before and behind the fault; autosar-e2e",
    status="validated",
)

AT = 100


def frames(batch: FrameBatch) -> Counter:
    """Frames as a bag, whatever their order."""
    return Counter(zip(batch.can_id.tolist(), batch.words.tolist(), strict=True))


def mine(batch: FrameBatch, receiver: int) -> FrameBatch:
    return batch[CODEC.number_of[batch.can_id & 0x7FF] == receiver]


def test_loss_leaves_the_others_in_order():
    one = strike("rx2 RANGE,RATE loss @100+1")[AT]
    gone = np.isin(one.before.can_id, [CODEC.can_id_of["RANGE", 2], CODEC.can_id_of["RATE", 2]])
    assert one.block == one.before[~gone] and gone.sum() == 12


@pytest.mark.parametrize(("spacing", "behind"), [("at once", True), ("block", False)])
def test_repetition(spacing, behind):
    line = "rx1 RANGE repetition 2 @100+1" + ("" if behind else " spacing=block")
    one = strike(line)[AT]
    added = frames(one.block) - frames(one.before)
    assert sum(added.values()) == 12 and not frames(one.before) - frames(one.block)
    rows = np.flatnonzero(one.block.can_id == CODEC.can_id_of["RANGE", 1])
    assert len(rows) == 18
    if behind:
        assert (one.block.words[rows[0:18:3]] == one.block.words[rows[2:18:3]]).all()
    else:
        assert rows[-12:].tolist() == list(range(len(one.block) - 12, len(one.block)))


def test_a_repetition_may_count_as_new():
    struck = strike("rx1 ch0 RANGE repetition 1 @100+1 counter=recompute crc=recompute")
    rows = of_kind(struck[AT].block, "RANGE")
    rows = rows[rows.can_id == CODEC.can_id_of["RANGE", 1]]
    first, second = [row["e2e_counter"] for row in by_cantools(rows) if row["channel"] == 0]
    assert (second - first) % 15 == 1 and all_sound(rows)


def test_delay_brings_all_frames_later_as_they_were():
    struck = strike("rx3 delay 2 @100+5")
    for epoch in (100, 101):
        assert not len(mine(struck[epoch].block, 3))
    for epoch in (102, 103, 104):
        assert frames(mine(struck[epoch].block, 3)) == frames(mine(struck[epoch - 2].before, 3))
    both = frames(mine(struck[105].before, 3)) + frames(mine(struck[103].before, 3))
    assert frames(mine(struck[105].block, 3)) == both
    assert all((one.block.t_ns == one.before.t_ns[0]).all() for one in struck), "stamped when they come"


def test_jitter_loses_nothing_and_is_never_early():
    struck = strike("rx3 jitter 3 @100+10")
    sent, came = Counter(), Counter()
    for one in struck:
        sent, came = sent + frames(one.before), came + frames(one.block)
        assert not came - sent, "nothing comes before it was sent"
    assert came == sent
    waits = [len(mine(one.before, 3)) - len(mine(one.block, 3)) for one in struck[100:113]]
    assert any(w > 0 for w in waits) and any(w < 0 for w in waits)


@pytest.mark.parametrize("order", ["drawn", "backwards"])
def test_reordering_keeps_the_frames_and_the_places_of_others(order):
    one = strike(f"rx1 reordering {order} @100+1")[AT]
    assert frames(one.block) == frames(one.before)
    others = CODEC.number_of[one.before.can_id] != 1
    assert one.block[others] == one.before[others]
    assert (one.block.words != one.before.words).any()
    if order == "backwards":
        assert (mine(one.block, 1).words == mine(one.before, 1).words[::-1]).all()


def test_insertion_of_a_message_is_counted_by_a_sender_of_its_own():
    struck = strike("insertion message=ATT_RATE frames=2 @100+3")
    added = concat([one.block[len(one.before) :] for one in struck[100:103]])
    assert [row["e2e_counter"] for row in by_cantools(added)] == [0, 1, 2, 3, 4, 5]
    assert all_sound(added)


def test_insertion_of_bytes():
    one = strike("insertion identifier=0x3A5 data=DEADBEEF first=true @100+1")[AT]
    assert one.block.can_id[0] == 0x3A5 and one.block.length[0] == 4
    assert one.block.data[0].tobytes().hex() == "deadbeef00000000"
    assert one.block[1:] == one.before


def test_a_wrong_address_is_told_by_the_crc_unless_it_is_made_again():
    told, untold = (
        strike(f"rx1 RANGE wrong-address 0x110 @100+1 {more}")[AT] for more in ("", "crc=recompute")
    )
    for one, fits in ((told, False), (untold, True)):
        moved = one.block[one.block.can_id != one.before.can_id]
        assert len(moved) == 6 and set(moved.can_id.tolist()) == {0x110}
        assert all_sound(moved) is fits


@pytest.mark.parametrize("lag", [1, 16, 60])
def test_replay_is_what_was_sent(lag):
    struck = strike(f"rx2 RANGE,RATE,SV_* replay {lag} @100+10")
    kinds = [CODEC.can_id_of[kind, 2] for kind in ("RANGE", "RATE", "SV_X", "SV_CLOCK")]

    def chosen(batch):
        return batch[np.isin(batch.can_id, kinds)]

    for epoch in range(95, 115):
        source = epoch - lag if 100 <= epoch < 110 else epoch
        expected = chosen(undisturbed()[source][0])
        assert frames(chosen(struck[epoch].block)) == frames(expected), epoch
        rest = struck[epoch].block
        rest = rest[~((rest.can_id >= 0x110) & (rest.can_id <= 0x119))]
        before = struck[epoch].before
        assert rest == before[~((before.can_id >= 0x110) & (before.can_id <= 0x119))]


def test_a_replay_of_what_was_never_heard_is_none():
    struck = strike("rx2 replay 50 @10+5")
    assert all(one.block == one.before for one in struck)


def test_babbling_goes_before_all():
    one = strike("babbling 500 @100+1")[AT]
    assert (one.block.can_id[:500] == 1).all() and one.block[500:] == one.before
