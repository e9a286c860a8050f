"""Permissions as commands: kept channels, handover, repetition, refusal, contradiction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.flightsw.measurement.signals import satellite_of, seconds, signal_of, track_of
from gnss_hil.flightsw.receivers import channel_manager as k
from gnss_hil.flightsw.receivers.channel_table import IDLE, UNKNOWN
from gnss_hil.flightsw.receivers.options import ChannelOptions
from gnss_hil.flightsw.records.epoch import NO_ACKS, NO_MEASUREMENTS, Acks

pytestmark = pytest.mark.verifies(
    "flightsw/receivers/channel_manager.py",
    "flightsw/receivers/channel_table.py",
    "flightsw/receivers/satellite_table.py",
    "flightsw/receivers/options.py",
    what="Commands until acknowledged",
    by="rules of docs/contract.md",
    status="modelled",
)

OPTIONS = ChannelOptions(resend_epochs=2, backoff_epochs=5)
G1, G2, G3, R1 = 1, 2, 3, 65
NONE = NO_MEASUREMENTS
UNHEARD = np.full(8, -1, np.int64)


L2C, L2OF, NO_SUCH_SIGNAL = 4, 6, 7


def with_second(**signal_of):
    """Signals beside the first ones, by satellite."""
    second = k.NO_SECOND.copy()
    for name, signal in signal_of.items():
        second[globals()[name]] = signal
    return second


def permit(**antenna_of):
    permitted = np.full(SATELLITES, -1, np.int64)
    for name, antenna in antenna_of.items():
        permitted[globals()[name]] = antenna
    return permitted


def measured(*rows):
    """Measurements that say receiver, channel and satellite."""
    receiver, channel, sat = np.array(rows, np.int64).reshape(-1, 3).T
    flat = np.zeros(len(sat))
    three = np.zeros((3, len(sat)))
    signal = np.zeros(len(sat), np.int64)
    return type(NONE)(receiver, channel, sat, *[flat] * 6, three, three, flat, flat, signal, flat)


def answers(commands, result=0, rows=slice(None)):
    n = len(commands.sat[rows])
    return Acks(
        commands.antenna[rows],
        commands.channel[rows],
        np.full(n, result),
        commands.sat[rows],
        commands.transaction[rows],
    )


def listed(commands):
    return list(
        zip(*(getattr(commands, f).tolist() for f in ("antenna", "channel", "action", "sat")), strict=True)
    )


def settled(permitted, seen=NONE, channels=(2, 2)):
    """A channel manager all of whose commands were acknowledged."""
    c = k.planned(k.autonomous(np.array(channels), 8), permitted, seen)
    c, commands = k.due(c, 0, OPTIONS)
    c = k.acknowledged(c, answers(commands), 1, OPTIONS)
    assert (c.channels.held == c.channels.target).all()
    return c


def test_takeover_keeps_satellites_on_their_channels_and_releases_the_rest():
    seen = measured((0, 0, G3), (0, 1, G1), (1, 0, G1), (1, 1, G2))
    c = k.planned(k.autonomous(np.array([2, 2]), 8), permit(G1=0, G2=1), seen)
    c, commands = k.due(c, 0, OPTIONS)
    assert listed(commands) == [
        (0, 0, k.RELEASE, 0),
        (1, 0, k.RELEASE, 0),
        (0, 1, k.TRACK, G1),
        (1, 1, k.TRACK, G2),
    ]
    assert commands.transaction.tolist() == [0, 1, 2, 3]


def test_an_answer_that_names_another_satellite_is_to_no_command_of_ours():
    """The command was altered on its way: it is sent again, and what was asked is not held."""
    c = k.planned(k.autonomous(np.array([2]), 8), permit(G1=0, G2=0), NONE)
    c, commands = k.due(c, 0, OPTIONS)
    altered = replace(answers(commands), sat=np.where(commands.sat == G1, G3, commands.sat))
    c = k.acknowledged(c, altered, 1, OPTIONS)
    assert c.statistics.accepted == 1
    c, again = k.due(c, OPTIONS.resend_epochs, OPTIONS)
    assert listed(again) == [row for row in listed(commands) if row[3] == G1]
    c = k.acknowledged(c, answers(again), 3, OPTIONS)
    assert (c.channels.held == c.channels.target).all()


def test_an_answer_to_a_release_may_name_any_satellite():
    c = settled(permit(G1=0, G2=0), channels=(2,))
    c, commands = k.due(k.planned(c, permit(G2=0), NONE), 5, OPTIONS)
    assert commands.action.tolist() == [k.RELEASE]
    c = k.acknowledged(c, replace(answers(commands), sat=np.array([R1])), 6, OPTIONS)
    assert (c.channels.held == c.channels.target).all()


def test_a_channel_is_usable_until_it_answers_then_only_as_commanded():
    """Receivers may refuse a restarted flight software's first commands, all but a few: their channels go on
    measuring what they found, and a fix is made of them."""
    seen = measured((0, 0, G3), (0, 1, G1), (1, 0, G1), (1, 1, G2))
    c = k.planned(k.autonomous(np.array([2, 2]), 8), permit(G1=0, G2=1), seen)
    c, commands = k.due(c, 0, OPTIONS)
    assert not c.commanded and k.usable(c, seen).all()
    c = k.acknowledged(c, answers(commands, rows=slice(2, 3)), 1, OPTIONS)
    assert c.commanded
    assert k.usable(c, seen).tolist() == [True, True, True, True]
    c = k.acknowledged(c, answers(commands), 2, OPTIONS)
    assert k.usable(c, seen).tolist() == [False, True, False, True]


def test_a_channel_that_refused_its_first_command_is_out_of_the_fix():
    """It searches by itself as before, but waits for no answer: what it finds another antenna may have."""
    seen = measured((0, 0, G1), (1, 0, G2))
    c = k.planned(k.autonomous(np.array([1, 1]), 8), permit(G1=0, G3=1), seen)
    c, commands = k.due(c, 0, OPTIONS)
    assert listed(commands) == [(0, 0, k.TRACK, G1), (1, 0, k.TRACK, G3)]
    c = k.acknowledged(c, answers(commands, rows=slice(0, 1)), 1, OPTIONS)
    assert k.usable(c, seen).tolist() == [True, True]
    c = k.acknowledged(c, answers(commands, result=3, rows=slice(1, 2)), 2, OPTIONS)
    assert k.usable(c, seen).tolist() == [True, False]


def test_unanswered_commands_repeat_under_their_number_by_epochs():
    c = k.planned(k.autonomous(np.array([1]), 8), permit(G1=0), NONE)
    sent = []
    for epoch in range(7):
        c, commands = k.due(k.acknowledged(c, NO_ACKS, epoch, OPTIONS), epoch, OPTIONS)
        sent.append(commands.transaction.tolist())
    assert sent == [[0], [], [0], [], [0], [], [0]]
    assert (c.statistics.sent, c.statistics.repeated) == (1, 3)


def test_handover_releases_the_old_and_commands_the_new_in_one_block():
    c = settled(permit(G1=0, G2=0, G3=1))
    c = k.planned(c, permit(G1=1, G2=0, G3=1), NONE)
    c, commands = k.due(c, 1, OPTIONS)
    assert listed(commands) == [(0, 0, k.RELEASE, 0), (1, 1, k.TRACK, G1)]


def test_lost_release_never_lets_a_satellite_in_from_two_antennas():
    c = settled(permit(G1=0, G3=1))
    c = k.planned(c, permit(G1=1, G3=1), NONE)
    c, commands = k.due(c, 1, OPTIONS)
    c = k.acknowledged(c, answers(commands, rows=slice(1, 2)), 2, OPTIONS)
    both = measured((0, 0, G1), (1, 0, G3), (1, 1, G1))
    assert k.usable(k.contradicted(c, both, UNHEARD), both).tolist() == [False, True, True]
    c, again = k.due(c, 3, OPTIONS)
    assert listed(again) == [(0, 0, k.RELEASE, 0)]


@pytest.mark.parametrize("result", [2, 3, 4, 5, 6])
def test_refused_satellite_is_left_alone(result):
    c = settled(permit(G1=0))
    c = k.planned(c, permit(G1=0, G2=0), NONE)
    c, commands = k.due(c, 1, OPTIONS)
    c = k.acknowledged(c, answers(commands, result), 2, OPTIONS)
    assert c.statistics.refused[result] == 1
    assert c.satellites.blocked_until[G2] == 7 and c.satellites.blocked_until[G1] < 0
    assert c.channels.target.tolist() == [G1, IDLE, IDLE, IDLE]
    # The permissions may stay as they are; the plan must not.
    assert c.stale


@pytest.mark.parametrize("result", [1, 7, 8])
def test_refusing_channel_waits(result):
    c = k.planned(k.autonomous(np.array([1]), 8), permit(G1=0), NONE)
    c, commands = k.due(c, 0, OPTIONS)
    c = k.acknowledged(c, answers(commands, result), 1, OPTIONS)
    c = k.planned(c, permit(G1=0), NONE)
    assert [len(k.due(c, epoch, OPTIONS)[1]) for epoch in range(1, 8)] == [0, 0, 0, 0, 0, 1, 1]


def test_late_answer_to_a_superseded_command_has_no_effect():
    c = k.planned(k.autonomous(np.array([1]), 8), permit(G1=0), NONE)
    c, old = k.due(c, 0, OPTIONS)
    c = k.planned(c, permit(G2=0), NONE)
    c, _ = k.due(c, 1, OPTIONS)
    c = k.acknowledged(c, answers(old), 2, OPTIONS)
    assert c.channels.held.tolist() == [UNKNOWN] and not c.commanded


def test_going_back_before_the_answer_commands_again():
    """The receiver may have obeyed the command that was taken back."""
    c = settled(permit(G1=0), channels=(1,))
    c, _ = k.due(k.planned(c, permit(G2=0), NONE), 1, OPTIONS)
    c = k.planned(c, permit(G1=0), NONE)
    c, commands = k.due(c, 2, OPTIONS)
    assert listed(commands) == [(0, 0, k.TRACK, G1)]


def test_contradiction_makes_the_channel_unknown_and_commands_it_anew():
    c = settled(permit(G1=0, R1=1))
    wrong = measured((0, 0, G2), (1, 0, R1))
    c = k.contradicted(c, wrong, UNHEARD)
    assert k.usable(c, wrong).tolist() == [False, True]
    c = k.planned(c, c.satellites.permitted, wrong)
    assert listed(k.due(c, 5, OPTIONS)[1]) == [(0, 0, k.TRACK, G1)]


def test_restarted_receiver_is_commanded_anew():
    c = settled(permit(G1=0, R1=1))
    boots = np.array([4, 9, -1, -1, -1, -1, -1, -1])
    c = k.contradicted(c, NONE, boots)
    assert not c.stale
    c = k.contradicted(c, NONE, np.where(boots == 9, 10, boots))
    c = k.planned(c, c.satellites.permitted, NONE)
    assert listed(k.due(c, 5, OPTIONS)[1]) == [(1, 1, k.RELEASE, 0), (1, 0, k.TRACK, R1)]


def test_surrender_sets_every_channel_free():
    c = k.surrendered(settled(permit(G1=0, R1=1)))
    c, commands = k.due(c, 9, OPTIONS)
    assert commands.action.tolist() == [k.AUTONOMOUS] * 4
    c = k.acknowledged(c, answers(commands), 10, OPTIONS)
    assert not c.commanded


def test_surrender_reaches_channels_of_unknown_state():
    c = k.contradicted(settled(permit(G1=0, R1=1)), measured((0, 0, G3)), UNHEARD)
    _, commands = k.due(k.surrendered(c), 9, OPTIONS)
    assert commands.action.tolist() == [k.AUTONOMOUS] * 4


def test_a_handover_that_ends_in_surrender_is_none():
    """Taken over again the satellite is new: nothing was handed over, and no gap is counted."""
    c = k.used(settled(permit(G1=0, G2=0)), np.array([G1, G2]), 4)
    c = k.planned(c, permit(G1=1, G2=0), NONE)
    assert c.satellites.moving[G1]
    c = k.planned(k.surrendered(c), permit(G1=1, G2=0), NONE)
    c = k.used(c, np.array([G1, G2]), 90)
    assert (c.statistics.handovers, c.statistics.gap_epochs) == (0, 0)


def test_gap_of_a_handover_is_counted_in_epochs():
    c = settled(permit(G1=0, G2=0))
    c = k.used(c, np.array([G1, G2]), 4)
    c = k.planned(c, permit(G1=1, G2=0), NONE)
    c = k.used(c, np.array([G2]), 5)
    assert c.statistics.handovers == 0
    c = k.used(k.used(c, np.array([G1, G2]), 7), np.array([G1, G2]), 8)
    assert (c.statistics.handovers, c.statistics.gap_epochs, c.statistics.gap_longest) == (1, 2, 2)


def test_satellite_given_up_in_between_is_not_handed_over():
    c = k.used(settled(permit(G1=0)), np.array([G1]), 4)
    c = k.planned(k.planned(c, permit(), NONE), permit(G1=1), NONE)
    assert k.used(c, np.array([G1]), 90).statistics.handovers == 0


def test_glonass_is_commanded_on_its_own_signal():
    assert signal_of(np.array([G1, R1])).tolist() == [0, 1]


def test_strange_answers_and_measurements_are_ignored():
    c = settled(permit(G1=0))
    strange = Acks(*(np.array(v) for v in ([7, 0], [31, 0], [0, 0], [5, 5], [0, 4000])))
    assert np.array_equal(k.acknowledged(c, strange, 2, OPTIONS).channels.held, c.channels.held)
    beyond = measured((6, 20, G1))
    assert k.usable(c, beyond).tolist() == [False]
    assert k.contradicted(c, beyond, UNHEARD) is c


def pair_commanded(**second):
    """G1 on antenna 0 by a pair of signals, G2 on antenna 1 as `second` has it: the manager, its commands."""
    c = k.autonomous(np.array([4, 4]), 8)
    return k.due(k.planned(c, permit(G1=0, G2=1), NONE, with_second(G1=L2C, **second)), 0, OPTIONS)


def test_a_pair_is_two_commands_to_one_antenna():
    c, commands = pair_commanded()
    tracks = {(a, int(s), int(n)) for a, action, s, n in zip(
        commands.antenna, commands.action, commands.sat, commands.signal, strict=True
    ) if action == k.TRACK}  # fmt: skip
    assert tracks == {(0, G1, 0), (0, G1, L2C), (1, G2, 0)}
    c = k.acknowledged(c, answers(commands), 1, OPTIONS)
    assert (c.channels.held == c.channels.target).all()
    again = k.planned(c, permit(G1=0, G2=1), NONE, with_second(G1=L2C))
    assert again is c, "nothing has changed"


def by_signals(*rows):
    """Measurements that say receiver, channel, satellite and signal."""
    m = measured(*(row[:3] for row in rows))
    return replace(m, signal=np.array([row[3] for row in rows]))


def test_each_channel_of_a_pair_has_to_measure_its_own_signal():
    c, commands = pair_commanded()
    c = k.acknowledged(c, answers(commands), 1, OPTIONS)
    channel = dict(
        zip(zip(commands.sat.tolist(), commands.signal.tolist(), strict=True), commands.channel, strict=True)
    )
    first, second = channel[G1, 0], channel[G1, L2C]
    right = by_signals((0, first, G1, 0), (0, second, G1, L2C))
    assert k.usable(c, right).all()
    assert k.contradicted(c, right, UNHEARD) is c
    crossed = by_signals((0, first, G1, L2C), (0, second, G1, 0))
    assert not k.usable(c, crossed).any()
    off = k.contradicted(c, crossed, UNHEARD)
    assert (off.channels.held == UNKNOWN).sum() == 2 and off.stale


def test_a_second_signal_that_is_refused_leaves_the_satellite_and_the_channel():
    c, commands = pair_commanded()
    result = np.where(commands.signal == L2C, NO_SUCH_SIGNAL, 0)
    c = k.acknowledged(c, replace(answers(commands), result=result), 1, OPTIONS)
    assert c.stale
    assert c.satellites.single_until[G1] == 1 + OPTIONS.second_signal_backoff_epochs
    assert (c.satellites.blocked_until < 0).all(), "the satellite is not refused"
    assert (c.channels.not_before < 0).all(), "the channel is not refused"
    c, again = k.due(k.planned(c, permit(G1=0, G2=1), NONE), 1, OPTIONS)
    assert not (again.signal == L2C).any() and not ((again.sat == G1) & (again.action == k.TRACK)).any()


@pytest.mark.parametrize(
    ("result", "wait"),
    [(1, None), (3, "backoff_epochs"), (4, "backoff_epochs"), (5, "backoff_epochs"),
     (6, "second_signal_backoff_epochs"), (7, "second_signal_backoff_epochs"), (8, None)],
)  # fmt: skip
def test_no_refusal_of_a_second_signal_costs_the_first(result, wait):
    """Results of docs/contract.md; a receiver that does not tell signals apart answers that it tracks it."""
    c, commands = pair_commanded()
    results = np.where(commands.signal == L2C, result, 0)
    c = k.acknowledged(c, replace(answers(commands), result=results), 1, OPTIONS)
    assert (c.satellites.blocked_until < 0).all()
    if wait is None:
        assert (c.satellites.single_until < 0).all() and (c.channels.not_before > 0).sum() == 1
    else:
        assert c.satellites.single_until[G1] == 1 + getattr(OPTIONS, wait)
        assert (c.channels.not_before < 0).all()


def test_a_first_signal_that_is_refused_is_the_channels_fault():
    c, commands = pair_commanded()
    result = np.where(commands.signal == L2C, 0, NO_SUCH_SIGNAL)
    c = k.acknowledged(c, replace(answers(commands), result=result), 1, OPTIONS)
    assert (c.channels.not_before == 1 + OPTIONS.backoff_epochs).sum() == len(commands) - 1
    assert (c.satellites.single_until < 0).all()


def test_a_pair_is_handed_over_as_one():
    c, commands = pair_commanded()
    c = k.used(k.acknowledged(c, answers(commands), 1, OPTIONS), np.array([G1, G2]), 4)
    c = k.planned(c, permit(G1=1, G2=1), NONE, with_second(G1=L2C))
    c, commands = k.due(c, 5, OPTIONS)
    moved = commands.sat == G1
    assert commands.antenna[moved & (commands.action == k.TRACK)].tolist() == [1, 1]
    released = commands.antenna[commands.action == k.RELEASE]
    assert released.tolist() == [0, 0]
    c = k.used(k.acknowledged(c, answers(commands), 6, OPTIONS), np.array([G1, G2]), 9)
    assert (c.statistics.handovers, c.statistics.gap_epochs) == (1, 4)


def test_another_second_signal_is_another_plan_for_the_same_antennas():
    c, commands = pair_commanded()
    c = k.acknowledged(c, answers(commands), 1, OPTIONS)
    c, more = k.due(k.planned(c, permit(G1=0, G2=1), NONE, with_second(G1=L2C, G2=L2C)), 2, OPTIONS)
    assert listed(more) == [(1, 1, k.TRACK, G2)] and more.signal.tolist() == [L2C]
    freed = k.surrendered(c).satellites
    assert not freed.second.any()


@pytest.mark.parametrize(("sat", "signal", "track"), [
    (G1, 0, G1), (R1, 1, R1), (G1, L2C, G1 + 512 * L2C), (R1, L2OF, R1 + 512 * L2OF),
])  # fmt: skip
def test_tracks_are_satellites_and_signals(sat, signal, track):
    found = track_of(np.array([sat]), np.array([signal]))
    assert found.tolist() == [track]
    assert satellite_of(found).tolist() == [sat] and signal_of(found).tolist() == [signal]


def test_the_second_signal_of_a_receiver_is_that_of_its_most_wanted_pair():
    """L2 before L5, as pairs stand in `gnss_hil.flightsw.measurement.signals`; none without one."""
    found = seconds((("L5", "L2C", "L2OF"), ("L5",), ()))
    assert found[:, 0].tolist() == [4, 5, 0] and found[:, 1].tolist() == [6, 0, 0]
