"""What the flight software says of its checks: frames written by hand, and what is read out of them."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.tools.results import checks
from tests.tools.decoder.test_digest import CODEC, USED, Sender, channel, digested, frames_of, navigation

pytestmark = pytest.mark.verifies(
    "tools/decoder/flight_checks.py",
    what="What the flight software refused and left out of fixes",
    by="frames written by hand",
    status="validated",
)

FIVE = [channel(1, 0, 0), channel(1, 3, 1), channel(2, 0, 2), channel(3, 5, 3), channel(4, 1, 4)]
FULL = raw_of("Lock")["FULL"]


def refused(*rows: tuple[str, int, int]) -> FrameBatch:
    """NAV_REFUSED of reasons, identifiers, counts."""
    return concat(
        frames_of("NAV_REFUSED", slot=slot, reason=raw_of("Refused")[reason], identifier=can_id, count=count)
        for slot, (reason, can_id, count) in enumerate(rows)
    )


def fix(satellites: int, receivers: int, used: dict[int, int], mode: int = 2) -> FrameBatch:
    """A navigation block that says how much it left out."""
    rest = navigation(mode, used)
    status = frames_of(
        "NAV_STATUS", mode=mode, satellites=5, measurements=6, pdop=1.25, tested=raw_of("Tested")["CHECKED"],
        excluded_satellites=satellites, excluded_receivers=receivers,
    )  # fmt: skip
    return concat([status, rest[1:]])


def left_out(*blocks: FrameBatch, more: tuple[FrameBatch, ...] = ()) -> list[tuple]:
    """Epochs, checks, places, counts of what the fixes of blocks left out."""
    sender = Sender()
    digest, _ = digested(*(sender.block(e, *FIVE, *more, one) for e, one in enumerate(blocks)))
    table = checks.columns("craft", digest)
    rows = zip(table["epoch"].values.tolist(), table["check"], table["where"], table["count"], strict=True)
    return [row for row in rows if row[1].startswith("EXCLUDED")]


def test_what_it_refused_is_a_row_each_by_its_own_word():
    can_id = CODEC.can_id_of["SV_CLOCK", 2]
    said = refused(("MOVED", can_id, 3), ("TIMED_OUT", CODEC.can_id_of["HEARTBEAT", 4], 1))
    sender = Sender()
    blocks = [
        sender.block(0, *FIVE, navigation(used=USED)),
        sender.block(1, *FIVE, navigation(used=USED), said),
    ]
    digest, _ = digested(*blocks)
    table = checks.columns("craft", digest)
    found = zip(table["epoch"].values.tolist(), table["check"], table["where"], table["count"], table["by"],
                strict=True)  # fmt: skip
    name = CODEC.sender_of[CODEC.can_id_of["HEARTBEAT", 4]]
    assert [*found] == [
        (1, "MOVED", "RX2_SV_CLOCK", 3, "FLIGHT"), (1, "TIMED_OUT", f"{name}_HEARTBEAT", 1, "FLIGHT"),
    ]  # fmt: skip


def test_what_is_left_out_is_named_where_it_is_as_many_as_it_says():
    without_g03 = {1: 0b1001, 3: 0b100000, 4: 0b10}
    found = left_out(fix(0, 0, USED), fix(1, 0, without_g03), fix(1, 1, without_g03))
    assert found == [
        (1, "EXCLUDED_SATELLITE", "G03", 1), (2, "EXCLUDED_SATELLITE", "G03", 1),
        (2, "EXCLUDED_RECEIVER", "RX2", 1),
    ]  # fmt: skip


def test_where_it_cannot_be_told_which_it_is_counted():
    assert left_out(fix(2, 0, {1: 1, 3: 0b100000})) == [(0, "EXCLUDED_SATELLITE", "FLIGHT", 2)]


def test_of_a_fix_that_does_not_say_what_is_in_it_nothing_is_named():
    assert left_out(fix(5, 0, {})) == [(0, "EXCLUDED_SATELLITE", "FLIGHT", 5)]


def test_of_an_epoch_without_a_fix_nothing_is_left_out():
    assert left_out(fix(2, 1, {}, mode=0)) == []


@pytest.mark.parametrize("why", [{"lock": 2}, {"health": 1}, {"ura": 15}])
def test_what_no_fix_may_have_was_not_left_out(why):
    """A sixth satellite that is searched for, unhealthy or without a prediction is in no fix anyway."""
    (kind,) = {"lock": ["RATE"], "health": ["SV_Z"], "ura": ["SV_VZ"]}[next(iter(why))]
    layout = CODEC.kinds[kind]
    frames = channel(2, 4, 0)
    mine = CODEC.kind_of[frames.can_id] == layout.number
    said = {"RATE": {"cn0_dbhz": 40.25, "lock": 5}, "SV_Z": {"z_m": 1.5e7}, "SV_VZ": {"vz_mps": -3}}[kind]
    spare = concat(
        [
            frames[~mine & (CODEC.kind_of[frames.can_id] != CODEC.kinds["SV_CLOCK"].number)],
            frames_of(kind, 2, channel=4, **{**said, **why}),
            frames_of("SV_CLOCK", 2, channel=4, sat_system=0, sat_number=9, clock_m=12.5),
        ]
    )
    without_g03 = {1: 0b1001, 3: 0b100000, 4: 0b10}
    assert left_out(fix(1, 0, without_g03), more=(spare,)) == [(0, "EXCLUDED_SATELLITE", "G03", 1)]


def test_without_a_believed_time_each_answer_is_of_an_epoch_more():
    """Its answers go on under the epoch of the last mark that it believed; those that refuse come last."""
    said = [refused(("JUMPED", CODEC.can_id_of["TIME_MARK", 0], count)) for count in (1, 2)]
    nav = navigation(used=USED)
    sender = Sender()
    blocks = [sender.block(e, *FIVE) for e in range(3)]
    answers = [
        sender.alone(0, one)
        for one in (nav, concat([navigation(0), said[0]]), concat([navigation(0), said[1]]))
    ]
    digest, _ = digested(*(concat(pair) for pair in zip(blocks, answers, strict=True)))
    table = checks.columns("craft", digest)
    rows = zip(table["epoch"].values.tolist(), table["check"], table["count"], strict=True)
    assert [row for row in rows if row[1] == "JUMPED"] == [(1, "JUMPED", 1), (2, "JUMPED", 2)]


def test_what_it_does_without_is_told():
    sender = Sender()
    nav = navigation(used=USED)
    state = frames_of("NAV_STATE", mode=2, attitude_held=1, unheeded=1)
    digest, _ = digested(sender.block(0, *FIVE, nav), sender.block(1, *FIVE, nav, state))
    table = checks.columns("craft", digest)
    found = zip(table["epoch"].values.tolist(), table["check"], table["by"], strict=True)
    assert [*found] == [(1, "ATTITUDE_HELD", "FLIGHT"), (1, "UNHEEDED", "FLIGHT")]


def test_an_epoch_of_which_the_mark_is_missing_is_told_by_the_frames_of_several_nodes():
    sender = Sender()
    blocks = [
        sender.block(0, *FIVE),
        sender.alone(1, concat(FIVE)),
        sender.alone(2, FIVE[0]),
        sender.block(3, *FIVE),
    ]
    digest, _ = digested(*blocks)
    table = checks.columns("craft", digest)
    rows = zip(table["epoch"].values.tolist(), table["check"], table["where"], strict=True)
    marks = [row for row in rows if row[1] == "MARK"]
    assert marks == [(1, "MARK", "TIME"), (3, "MARK", "TIME")], "of epoch 2 one receiver alone sent"


def test_an_answer_that_names_another_satellite_than_its_command_is_told():
    sender = Sender()
    command = [
        frames_of("COMMAND", 2, channel=k, action=1, sat_number=7 + k, transaction=5 + k) for k in range(2)
    ]
    ack = [frames_of("ACK", 2, channel=k, result=0, sat_number=7, transaction=5 + k) for k in range(2)]
    digest, _ = digested(sender.block(0, *FIVE, *command), sender.block(1, *ack, *FIVE))
    table = checks.columns("craft", digest)
    rows = zip(table["epoch"].values.tolist(), table["check"], table["where"], table["count"], strict=True)
    assert [row for row in rows if row[1] == "OTHER_ANSWER"] == [(1, "OTHER_ANSWER", "RX2", 1)]
