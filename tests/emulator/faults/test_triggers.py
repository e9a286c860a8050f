"""Triggers: when they come about, against what cantools reads in the frames."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import batch, concat
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.emulator.faults.triggers import Seen, Watch, meaning
from gnss_hil.tools.decoder.command_log import CommandLog
from tests.support.faulted import CODEC, EPOCHS, by_cantools, of_kind, undisturbed

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


class Rows:
    """Commands of an epoch as the record has them."""

    def __init__(self, frames):
        self.number = CODEC.number_of[frames.can_id]
        self.epoch = np.zeros(len(frames), int)
        read = CODEC.decode("COMMAND", frames.data)
        self._signals = {
            **read,
            "satellite": 64 * read["sat_system"] + read["sat_number"],
            "result": self.epoch,
        }

    def __getitem__(self, name: str):
        return self._signals[name].astype(int)


def blocks(frames):
    """The commands in some frames, for `CommandLog`."""
    commands = of_kind(frames, "COMMAND")
    return {"COMMAND": Rows(commands), "ACK": Rows(commands[:0])}


def test_commands_are_counted_as_the_summary_does():
    log, total, nth = CommandLog(), 0, {}
    for epoch, (_, answer) in enumerate(undisturbed()):
        log.take(np.array([0]), blocks(of_kind(answer, "COMMAND")))
        total = log.commands
        nth |= {n: epoch for n in range(1, total + 1) if n not in nth}
    assert came("third command") == nth[3] and came("12th command") == nth[12]
    assert came(f"{total + 1}th command") is None


def command(receiver: int, action: str, number: int, transaction: int, channel: int = 0):
    """A command to a channel of a receiver, about a satellite of GPS."""
    values = {
        "channel": channel,
        "action": raw_of("Action")[action],
        "sat_number": number,
        "transaction": transaction,
    }
    return batch(CODEC.can_id_of["COMMAND", receiver], CODEC.encode("COMMAND", values, 1))


TRACK_1, TRACK_2 = command(1, "TRACK", 12, 1), command(2, "TRACK", 12, 2)
RELEASE_1 = command(1, "RELEASE", 0, 3)
NOTHING = TRACK_1[:0]


@pytest.mark.parametrize(
    ("text", "epochs", "expected"),
    [
        ("first handover", [[TRACK_1], [NOTHING], [RELEASE_1, TRACK_2]], 2),
        ("first handover", [[TRACK_1], [command(1, "TRACK", 7, 4), TRACK_2]], 1),
        ("first handover", [[TRACK_1], [RELEASE_1], [TRACK_2]], None),
        ("first handover", [[TRACK_1, command(2, "TRACK", 7, 9)], [command(1, "TRACK", 3, 5)]], None),
        ("first handover", [[TRACK_1], [command(1, "TRACK", 12, 6, channel=3)]], None),
        ("second handover", [[TRACK_1], [RELEASE_1, TRACK_2], [command(2, "RELEASE", 0, 7), TRACK_1]], 2),
        ("second command", [[TRACK_1], [TRACK_1], [TRACK_1, TRACK_2]], 2),
    ],
)  # fmt: skip
def test_a_handover_is_what_an_epochs_commands_take_from_one_receiver_and_give_to_another(
    text, epochs, expected
):
    given = [concat(parts) for parts in epochs]
    assert came(text, given) == expected
    log, counted = CommandLog(), []
    for frames in given:
        log.take(np.array([0]), blocks(frames))
        counted.append(log.handovers if "handover" in text else log.commands)
    wanted = 1 if text.startswith("first") else 2
    assert next((epoch for epoch, n in enumerate(counted) if n >= wanted), None) == expected


def test_the_first_assignment_is_no_handover():
    """Receivers have satellites of their own choice when they are commanded first."""
    log = CommandLog()
    for _, answer in undisturbed():
        log.take(np.array([0]), blocks(of_kind(answer, "COMMAND")))
    first_handover = came("first handover")
    assert log.commands and (first_handover is None) == (log.handovers == 0)


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
