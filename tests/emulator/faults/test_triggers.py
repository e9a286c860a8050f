"""Triggers: when they come about, against what cantools reads in the frames."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.emulator.faults.triggers import Seen, Watch, meaning
from tests.support.faulted import CODEC, EPOCHS, by_cantools, of_kind, undisturbed
from tests.support.flown import channel_frames

pytestmark = pytest.mark.verifies(what="Faults: where and when they strike")

NAMES = ("fore", "starboard", "aft", "port")


def came(text: str, batches=None) -> int | None:
    """Epoch in which a trigger comes about in frames of epochs."""
    watch, seen = Watch(CODEC, [text], NAMES), Seen()
    for epoch, frames in enumerate(batches or [concat(both) for both in undisturbed()]):
        seen = watch.look(seen, frames, epoch)
    return seen.since.get(text)


def first(test) -> int | None:
    return next((epoch for epoch, both in enumerate(undisturbed()) if test(concat(both))), None)


def values(frames, kind: str, signal: str) -> list[float]:
    return [row[signal] for row in by_cantools(of_kind(frames, kind))] or [0.0]


def tracked(frames, receiver: int | None, number: int) -> bool:
    rows = of_kind(frames, "SV_CLOCK")
    told = zip(CODEC.number_of[rows.can_id].tolist(), by_cantools(rows), strict=True)
    return any(
        (row["sat_system"], row["sat_number"]) == (0, number) and receiver in (None, r) for r, row in told
    )


@pytest.mark.parametrize(
    ("text", "test"),
    [
        ("first command", lambda f: len(of_kind(f, "COMMAND")) > 0),
        ("first fix", lambda f: any(row["mode"] for row in by_cantools(of_kind(f, "NAV_STATUS")))),
        ("G07 tracked", lambda f: tracked(f, None, 7)),
        ("G16 tracked on starboard", lambda f: tracked(f, 2, 16)),
        ("G16 tracked on rx2", lambda f: tracked(f, 2, 16)),
        ("NAV_STATUS.satellites > 12", lambda f: max(values(f, "NAV_STATUS", "satellites")) > 12),
        ("RATE.cn0_dbhz >= 48", lambda f: max(values(f, "RATE", "cn0_dbhz")) >= 48),
    ],
)  # fmt: skip
def test_the_first_epoch_in_which_it_holds(text, test):
    expected = first(test)
    assert expected is not None and 0 <= expected < EPOCHS
    assert came(text) == expected


def test_commands_are_counted():
    total, nth = 0, {}
    for epoch, (_, answer) in enumerate(undisturbed()):
        total += len(of_kind(answer, "COMMAND"))
        nth |= {n: epoch for n in range(1, total + 1) if n not in nth}
    assert came("third command") == nth[3] and came("12th command") == nth[12]
    assert came(f"{total + 1}th command") is None


ZEROS = ("p", "pdot", "x", "y", "z", "vx", "vy", "vz", "drift", "clock")
ROW = {name: [0.0] for name in ZEROS} | {"sat": [12]}


def measured(*receivers: int):
    """An epoch in which these receivers measure G12."""
    parts = [frame for r in receivers for frame in channel_frames(r, 0, ROW, 0)]
    return e2e.protect(CODEC, concat(parts), e2e.fresh_counters(CODEC), 0)[0]


def test_a_handover_is_a_satellite_on_another_receiver_and_no_longer_on_its_own():
    none = measured(3)[:0]
    assert came("first handover", [measured(1), measured(1), measured(2)]) == 2
    assert came("first handover", [measured(1), none, none, measured(2)]) == 3
    assert came("first handover", [measured(1), measured(1, 2), measured(1, 2)]) is None, "on both"
    assert came("second handover", [measured(1), measured(2), measured(1)]) == 2
    assert came("first handover", [measured(1), none, measured(1)]) is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("third comand", "no event 'comand'; did you mean 'command'?"),
        ("RX1_RATE.cn0_dbh < 3", "RX1_RATE has no signal 'cn0_dbh'; did you mean 'cn0_dbhz'?"),
        ("RX1_RAT.cn0_dbhz < 3", "no message 'RX1_RAT'; did you mean 'RX1_RATE'?"),
        ("G99 tracked", "'G99' is not a satellite name"),
        ("whenever", "trigger 'whenever': not one of"),
    ],
)
def test_what_is_no_trigger(text, words):
    with pytest.raises(ValueError) as caught:
        meaning(text)
    assert words in str(caught.value)


@pytest.mark.parametrize("text", ["G12 tracked on fort", "RX7_RATE.cn0_dbhz < 30"])
def test_what_is_none_on_this_bus(text):
    with pytest.raises(ValueError, match=r"no receiver 'fort'|no message RX7_RATE on a bus of 4"):
        Watch(CODEC, [text], NAMES)
