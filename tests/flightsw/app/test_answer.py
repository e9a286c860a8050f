"""What the flight software says of itself: how it flies, and what it refused, epoch by epoch."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.modes import RAW_MODE, Mode
from gnss_hil.flightsw.io.encode import REFUSALS, Standing, encode
from gnss_hil.flightsw.io.frame_statistics import CONSEQUENCE, Reason, no_rejections
from gnss_hil.flightsw.records.solution import NoFix, Solution
from gnss_hil.flightsw.records.solution import Tested as Word
from tests.support.flights import SKY, drop, fly, soyuz, status
from tests.support.flown import CODEC, FakeBus, decoded

pytestmark = pytest.mark.verifies(
    "flightsw/app/answer.py",
    "flightsw/io/encode.py",
    what="How the flight software says that it flies, and what it refused",
    by="blocks with frames left out or altered, against what was left out",
    status="validated",
)

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
STANDING = Standing(0, False, False, False, False, 0, 0)


def standing(answers, name):
    return [int(decoded(answer, "NAV_STATE")[name][0]) for answer in answers]


def test_words_on_the_bus_are_all_of_the_contracts_value_tables():
    refused = {word.value: word.name for word in [*Verdict, *Reason] if word is not Verdict.OK}
    assert refused == VALUES["Refused"] and set(refused) == set(CONSEQUENCE) - {Verdict.OK}
    assert {raw: mode.name for mode, raw in RAW_MODE.items()} == VALUES["FlightMode"]
    assert set(RAW_MODE) == set(Mode)
    assert {word.value: word.name for word in Word} == VALUES["Tested"]


def without(*rules):
    """Frames left out: kinds, epochs and the receiver they are of, or all."""

    def tamper(epoch, block):
        for kinds, epochs, receiver in rules:
            if epoch in epochs:
                of = np.isin(CODEC.kind_of[block.can_id], [CODEC.kinds[kind].number for kind in kinds])
                block = block[~(of & ((CODEC.number_of[block.can_id] == receiver) | (receiver is None)))]
        return block

    return tamper


def test_it_tells_every_epoch_how_it_flies():
    """No time in epoch 3, no attitude in 5, and longer than it may be held in 7 and 8; receiver 2 silent in
    10 and 11, and receiver 4 in 11."""
    every, attitude = list(CODEC.kinds), ["ATT_Q01"]
    rules = ([["TIME_FINE"], [3], None], [attitude, [5, 7, 8], None], [every, [10, 11], 2], [every, [11], 4])
    config = configure(SOYUZ, "patent", {"attitude_hold_epochs": 1})
    states, answers, _ = fly(FakeBus(soyuz(), SKY), config, 13, tamper=without(*rules))
    assert standing(answers, "mode") == [RAW_MODE[state.mode] for state in states]
    assert standing(answers, "without_time") == [int(k == 3) for k in range(13)]
    assert standing(answers, "attitude_held") == [int(k in (5, 7)) for k in range(13)]
    assert standing(answers, "without_attitude") == [int(k == 8) for k in range(13)]
    assert standing(answers, "silent_receivers") == [*[0] * 10, 0b0010, 0b1010, 0]
    assert standing(answers, "without_fix") == [int(k in (3, 8)) for k in range(13)]


def test_commands_that_nobody_answers_are_unheeded_until_they_are_answered():
    """From epoch 6 on answers arrive; the last command is repeated in 7."""
    config = configure(SOYUZ, "patent", {"resend_epochs": 3})
    states, answers, _ = fly(FakeBus(soyuz(), SKY), config, 12, tamper=drop(["ACK"], range(6)))
    first = next(k for k, answer in enumerate(answers) if len(decoded(answer, "COMMAND")["channel"]))
    told = standing(answers, "unheeded")
    assert told == [int(first + 3 <= k < 8) for k in range(12)] and sum(told)
    assert states[-1].channels.statistics.repeated > 0


def test_epochs_without_a_fix_saturate():
    config = configure(SOYUZ, "prototype")
    states, *_ = fly(FakeBus(soyuz(), SKY), config, 1)
    state = states[-1]
    object.__setattr__(state, "without_fix", 65_540)
    _, answers, _ = fly(FakeBus(soyuz(), SKY), config, 1, state=state, tamper=drop(["RANGE"], [0]))
    assert standing(answers, "without_fix") == [65535]


def refusals(answers):
    """(reason, identifier, count) of each epoch."""
    told = [decoded(answer, "NAV_REFUSED") for answer in answers]
    names = ("reason", "identifier", "count")
    return [list(zip(*(t[name].astype(int).tolist() for name in names), strict=True)) for t in told]


def test_what_was_refused_is_told_in_its_epoch_and_never_again():
    """A RANGE of receiver 3 is damaged in epoch 4; in epoch 6 another session begins."""
    damaged = CODEC.can_id_of["RANGE", 3]

    def tamper(epoch, block):
        if epoch == 4:
            block.data[np.flatnonzero(block.can_id == damaged)[0], 5] ^= 1
        return block

    config = configure(SOYUZ, "prototype")
    states, answers, _ = fly(FakeBus(soyuz(), SKY), config, 6, tamper=tamper)
    rows = refusals(answers)
    assert (Verdict.CORRUPTED, damaged, 1) in rows[4] and not any(rows[:4])
    assert {reason for reason, *_ in rows[5]} == {Verdict.LOST}, "the next of that stream says so"
    _, answers, _ = fly(FakeBus(soyuz(), SKY, session=8), config, 2, state=states[-1])
    assert refusals(answers) == [[], []]


def test_the_most_frequent_go_first_and_eight_at_most():
    refused = no_rejections()
    counts = {(2, 0x100): 3, (4, 0x100): 7, (4, 0x123): 1, (16, 0x101): 90_000, (17, 0x11F): 7,
              (18, 0x102): 5, (19, 0x010): 6, (20, 0x010): 2, (21, 0x701): 8, (27, 0x109): 4}  # fmt: skip
    for place, count in counts.items():
        refused[place] = count
    frames = encode(CODEC, 1, None, Solution(NoFix.NO_TIME_MARK), None, 1, STANDING, refused, 0)
    told = {name: values.astype(int).tolist() for name, values in decoded(frames, "NAV_REFUSED").items()}
    most = sorted(counts, key=lambda place: -counts[place])[:REFUSALS]
    assert REFUSALS == 8 and told["slot"] == list(range(8))
    assert list(zip(told["reason"], told["identifier"], strict=True)) == most
    assert told["count"] == [min(counts[place], 4095) for place in most]
    kinds = [CODEC.layouts[k].name for k in CODEC.kind_of[frames.can_id]]
    assert kinds == ["NAV_STATUS", "NAV_STATE", *["NAV_REFUSED"] * 8, "HEARTBEAT"]


def test_what_was_left_out_of_a_fix_is_counted():
    """A satellite on all antennas 300 m off; then a receiver."""

    class Off(FakeBus):
        def deliver(self, receiver, channel, o, k):
            off_m = 300.0 * ((channel == 2) if self.epoch == 3 else (receiver == 2) * (self.epoch == 4))
            return super().deliver(receiver, channel, {**o, "p": o["p"] + off_m}, k)

        def block(self, epoch, *more, **options):
            self.epoch = epoch
            return super().block(epoch, *more, **options)

    _, answers, _ = fly(Off(soyuz(), SKY, channels=8), configure(SOYUZ, "prototype"), 6)
    assert [status(answer, "excluded_satellites") for answer in answers] == [0, 0, 0, 1, 0, 0]
    assert [status(answer, "excluded_receivers") for answer in answers] == [0, 0, 0, 0, 1, 0]
    assert [status(answer, "no_fix") for answer in answers] == [NoFix.FIX] * 6
    assert {status(answer, "tested") for answer in answers} <= {Word.CHECKED, Word.TESTED}
