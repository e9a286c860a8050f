"""Marks, nodes, commands, receivers: frames before and behind each kind, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.lockstep import messages as bench
from tests.support.faulted import CODEC, SESSION, all_sound, by_cantools, of_kind, strike

pytestmark = pytest.mark.verifies(
    "emulator/faults/kinds/marks.py",
    "emulator/faults/kinds/nodes.py",
    "emulator/faults/kinds/commands.py",
    "emulator/faults/kinds/receivers.py",
    what="Faults: time marks, nodes, commands, receivers",
    by="cantools; autosar-e2e; GPS time worked out again; frames counted",
    status="validated",
)

NS = 1_000_000_000


def mine(frames, receiver: int):
    return frames[CODEC.number_of[frames.can_id & 0x7FF] == receiver]


def mark_of(frames) -> tuple[int, int, int]:
    """Epoch, GPS time [ns] and leap seconds of the first mark in a block."""
    rows = [by_cantools(of_kind(frames, kind))[0] for kind in ("TIME_MARK", "TIME_GPS", "TIME_FINE")]
    one = rows[0] | rows[1] | rows[2]
    return one["epoch"], gpstime.from_week(one["week"], one["second"], one["nanosecond"]), one["leap"]


@pytest.mark.parametrize(
    ("by", "seconds"),
    [
        ("10ms", 0.01),
        ("1s", 1),
        ("20m", 1200),
        ("1h", 3600),
        ("1w", 604_800),
        ("-1s", -1),
        ("-1024w", -1024 * 604_800),
    ],
)
def test_marks_jump(by, seconds):
    for epoch, one in enumerate(strike(f"mark-jump {by} @100+3")):
        number, t_ns, leap = mark_of(one.before)
        moved = round(seconds * NS) if 100 <= epoch < 103 else 0
        assert mark_of(one.block) == (number, t_ns + moved, leap)
        if epoch in (100, 104):
            assert all_sound(one.block[:3])


def test_a_leap_second_is_in_its_field():
    one = strike("mark-jump -1s leap_s=1 @100+1")[100]
    assert mark_of(one.block) == (100, mark_of(one.before)[1] - NS, 17)


def test_marks_missing_and_late():
    missing, late, held = (strike(f"{kind} @100+2") for kind in ("mark-missing", "mark-late", "mark-late 1"))
    assert missing[100].block == missing[100].before[3:]
    assert late[100].block[-3:] == late[100].before[:3] and late[100].block[:-3] == late[100].before[3:]
    assert held[100].block == held[100].before[3:]
    assert (held[102].block[-3:].data == held[101].before[:3].data).all() and len(held[102].block) == len(
        held[102].before
    ) + 3


def test_a_second_master_counts_its_own():
    struck = strike("second-time-master 1s session=9 epochs_ahead=2 @100+3")
    for k, one in enumerate(struck[100:103]):
        assert one.block[:3] == one.before[:3] and one.block[6:] == one.before[3:]
        added = one.block[3:6]
        assert mark_of(added) == (102 + k, mark_of(one.before)[1] + NS, mark_of(one.before)[2])
        told = by_cantools(added)
        assert told[0]["session"] == 9 and [row["e2e_counter"] for row in told] == [k] * 3
        assert all_sound(added)


def test_a_silent_node_sends_nothing_and_goes_on():
    struck = strike("ATT off @100+5")
    senders = {name for one in struck[100:105] for name in np.array(CODEC.sender_of)[one.block.can_id]}
    assert "ATT" not in senders and {"TIME", "RX1"} <= senders
    assert struck[105].block == struck[105].before


@pytest.mark.parametrize(
    ("line", "receiver"), [("ATT restart @100+3", 0), ("rx2 reset @100+3 reacquire_s=0", 2)]
)
def test_a_node_that_starts_anew_counts_from_zero_with_a_boot_more(line, receiver):
    struck = strike(line)
    node = "RX2" if receiver else "ATT"
    number = receiver or 9
    sent = [CODEC.sender_of[i] == node for i in struck[100].before.can_id]
    assert (
        struck[101].block
        == struck[101].before[~np.array([CODEC.sender_of[i] == node for i in struck[101].before.can_id])]
    )
    assert any(sent)
    for k in range(3):
        block = struck[103 + k].block
        own = block[np.array([CODEC.sender_of[i] == node for i in block.can_id])]
        beats = own[own.can_id == CODEC.can_id_of["HEARTBEAT", number]]
        assert [(row["boot_count"], row["e2e_counter"]) for row in by_cantools(beats)] == [(2, k)]
        kind = "RANGE" if receiver else "ATT_Q01"
        assert {row["e2e_counter"] for row in by_cantools(of_kind(own, kind))} == {k}
        assert all_sound(own)


def test_two_restarts_are_two_boots():
    struck = strike("ATT restart @50..90 every=20 on=2")
    beats = [by_cantools(one.block[one.block.can_id == CODEC.can_id_of["HEARTBEAT", 9]]) for one in struck]
    assert [rows[0]["boot_count"] for rows in (beats[49], beats[60], beats[80])] == [1, 2, 3]


def test_a_receiver_without_power_sends_nothing_hears_nothing_and_acquires():
    struck = strike("starboard off @30..100 reacquire_s=5")
    assert all(not len(mine(one.block, 2)) and not len(mine(one.answer, 2)) for one in struck[30:100])
    assert any(len(of_kind(one.answer, "COMMAND")) for one in struck[30:100]), "others are commanded"
    for epoch in range(100, 105):
        rows = mine(struck[epoch].block, 2)
        assert not len(of_kind(rows, "RANGE")) and len(of_kind(rows, "HEARTBEAT")) == 1
        told = by_cantools(of_kind(rows, "STATUS"))[0]
        assert (told["frames"], told["channels_tracking"]) == (1, 0) and all_sound(rows)
    assert (struck[105].block.data[:, 2:] == struck[105].before.data[:, 2:]).all()


def test_a_receiver_that_measures_nothing_counts_on_where_it_stood():
    """As one does that sends nothing: the counter of a channel follows the one before the antenna was cut."""
    struck = strike("port cut @100+8 reacquire_s=5")
    rows = {k: by_cantools(of_kind(mine(struck[k].block, 4), "RANGE")) for k in (99, 107, 112, 113, 114)}
    assert rows[107] == rows[112] == []
    counters = {k: {row["channel"]: row["e2e_counter"] for row in rows[k]} for k in (99, 113, 114)}
    assert len(counters[99]) == 6
    for channel, counter in counters[99].items():
        assert counters[113][channel] == (counter + 1) % 15 and counters[114][channel] == (counter + 2) % 15
    assert all_sound(struck[113].block)
    others = struck[113].block[np.array([CODEC.sender_of[i] != "RX4" for i in struck[113].block.can_id])]
    same = struck[113].before[np.array([CODEC.sender_of[i] != "RX4" for i in struck[113].before.can_id])]
    assert others == same, "nobody else's are touched"


def test_a_cut_antenna_is_silence_of_measurements_alone():
    one = strike("port cut @100+1")[100]
    kinds = {
        name
        for name in CODEC.kinds
        if len(of_kind(mine(one.before, 4), name)) and not len(of_kind(mine(one.block, 4), name))
    }
    assert kinds == {"RANGE", "RATE", "PHASE", "SV_X", "SV_Y", "SV_Z", "SV_VX", "SV_VY", "SV_VZ", "SV_CLOCK"}
    assert by_cantools(of_kind(mine(one.block, 4), "STATUS"))[0]["channels_tracking"] == 0


def test_garbage_keeps_the_channels_and_the_crcs():
    one = strike("rx2 receiver-garbage @100+1")[100]
    before, after = (of_kind(mine(frames, 2), "RANGE") for frames in (one.before, one.block))
    channels = [[row["channel"] for row in by_cantools(rows)] for rows in (before, after)]
    assert channels[0] == channels[1] and all_sound(after)
    assert (np.bitwise_count(before.words ^ after.words) > 5).all()
    assert of_kind(mine(one.block, 2), "STATUS") == of_kind(mine(one.before, 2), "STATUS")


def test_commands_lost_doubled_and_altered():
    lost, doubled, fresh, altered = (
        strike(line)
        for line in ("command-lost", "command-doubled", "command-doubled fresh=true", "command-altered R07")
    )
    sent = [of_kind(one.answer, "COMMAND") for one in strike("ATT loss @500")]
    assert sum(map(len, sent)) > 20
    assert not any(len(of_kind(one.answer, "COMMAND")) for one in lost)
    for was, two, new, other in zip(sent, doubled, fresh, altered, strict=True):
        twice = of_kind(two.answer, "COMMAND")
        assert (twice.words == np.repeat(was.words, 2)).all()
        again = of_kind(new.answer, "COMMAND")
        counters = [row["e2e_counter"] for row in by_cantools(again)]
        assert all(
            (b - a) % 15 == 1 for a, b in zip(counters[::2], counters[1::2], strict=True)
        ) and all_sound(again)
        told = by_cantools(of_kind(other.answer, "COMMAND"))
        assert {(row["sat_system"], row["sat_number"]) for row in told} <= {(1, 7)}
        assert all_sound(of_kind(other.answer, "COMMAND"))


def test_commands_late_come_whole():
    struck, sent = (
        strike("command-late 2"),
        [of_kind(one.answer, "COMMAND") for one in strike("ATT loss @500")],
    )
    for epoch in range(2, 130):
        assert of_kind(struck[epoch].answer, "COMMAND").words.tolist() == sent[epoch - 2].words.tolist()


def test_answers_lost():
    struck = strike("ack-lost")
    assert any(len(of_kind(one.before, "ACK")) for one in struck)
    assert not any(len(of_kind(one.block, "ACK")) for one in struck)


def test_a_second_flight_computer_beats_and_releases():
    struck = strike("second-flight-computer boot_count=9 @30..60")
    beats = [one.block[one.block.can_id == CODEC.can_id_of["HEARTBEAT", 16]] for one in struck]
    assert [len(rows) for rows in beats] == [0] * 30 + [1] * 30 + [0] * 70
    assert {row["boot_count"] for rows in beats[30:60] for row in by_cantools(rows)} == {9}
    for one in struck[30:60]:
        orders = by_cantools(of_kind(one.answer, "COMMAND"))
        half = len(orders) // 2
        assert [row["action"] for row in orders[half:]] == [0] * half
        assert [row["channel"] for row in orders[half:]] == [row["channel"] for row in orders[:half]]
        assert all_sound(of_kind(one.answer, "COMMAND"))


def test_a_stray_bench_frame_is_of_another_session():
    one = strike("stray-bench SYNC session=2 @100+1")[100]
    (row,) = bench.rows(one.block)
    assert bench.judge(one.block, row, SESSION, 100) is bench.Refusal.OTHER_SESSION
    assert bench.judge(one.block, row, SESSION + 2, 100).epoch == 100
