"""Which satellites the receivers are told to track, flown on a fake bus."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import EMPTY
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from tests.support.flights import SKY, SOYUZ, TRACK, error_m, fly, soyuz, status, tracked, used
from tests.support.flown import AUTO, FakeBus

pytestmark = pytest.mark.verifies(
    "flightsw/app/commanding.py",
    what="Satellites assigned and commanded",
    by="rules of ours, flown epoch by epoch: takeover, handover, lost commands, restarts",
    status="modelled",
)


def test_takeover_from_six_satellites_to_two_dozen(flight):
    _, _, states, answers, _ = flight
    satellites = [status(answer, "satellites") for answer in answers]
    assert satellites[0] == 6 and status(answers[0], "measurements") == 24
    assert min(satellites[-3:]) >= 22
    tally = states[-1].channels.statistics
    assert tally.accepted == tally.sent and tally.repeated == 0


def test_no_satellite_twice_once_taken_over(flight):
    *_, answers, blocks = flight
    for answer, block in zip(answers[1:], blocks[1:], strict=True):
        sat_of = tracked(block)
        sats = [sat_of[channel] for channel in used(answer)]
        assert len(sats) == len(set(sats)) == status(answer, "satellites")


def test_commands_name_the_nearest_antenna(flight):
    """Angles from the synthetic craft, not from the flight software."""
    bus, *_ = flight
    checked = 0
    for epoch, receiver, _, action, sat in bus.commands:
        if action != TRACK:
            continue
        t = float(epoch - 1)  # commanded in the epoch before it is obeyed
        away = bus.sky[sat].at(t) - bus.craft.orbit.at(t)
        body = bus.craft.dcm_eci(t) @ away / np.linalg.norm(away)
        angles = np.degrees(np.arccos(SOYUZ.boresight_body @ body))
        assert angles[receiver - 1] <= angles.min() + 0.01 and angles.min() < 85
        checked += 1
    assert checked >= 22


def test_prototype_commands_nothing_and_uses_every_channel():
    bus = FakeBus(soyuz(), SKY)
    _, answers, _ = fly(bus, configure(SOYUZ, "prototype", {}), 4)
    assert bus.commands == []
    assert status(answers[-1], "satellites") == 6 and len(used(answers[-1])) == 24
    assert error_m(bus.craft, answers[-1], 3) < 0.02


@pytest.mark.slow
def test_rolling_hands_satellites_over_without_disturbing_the_fix():
    bus = FakeBus(soyuz(rate=(0.03, 0, 0)), SKY, delay=1)
    states, answers, blocks = fly(bus, configure(SOYUZ, "patent", {}), 45)
    tally = states[-1].channels.statistics
    assert tally.handovers >= 5
    assert tally.gap_longest >= 1, "one epoch to acquire on the new antenna"
    for t, (answer, block) in enumerate(zip(answers, blocks, strict=True)):
        assert error_m(bus.craft, answer, t) < 0.02
        sats = [tracked(block)[channel] for channel in used(answer)]
        assert t == 0 or len(sats) == len(set(sats))


@pytest.mark.slow
def test_restarted_receiver_is_taken_over_again():
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "patent", {})
    states, _, _ = fly(bus, config, 8)
    bus.doing[2] = AUTO
    bus.boots[2] += 1
    states, answers, blocks = fly(bus, config, 6, states[-1], first=8)
    assert (states[-1].channels.channels.held == states[-1].channels.channels.target).all()
    for answer, block in zip(answers, blocks, strict=True):
        sats = [tracked(block)[channel] for channel in used(answer)]
        assert len(sats) == len(set(sats))


@pytest.mark.slow
def test_lost_commands_are_repeated_until_obeyed():
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "patent", {})
    state, answer = initial_state(config), EMPTY
    for epoch in range(14):
        deaf = epoch in (1, 2)
        state, answer = flight_step(config, state, bus.block(epoch, EMPTY if deaf else answer))
    assert state.channels.statistics.repeated >= 12
    assert (state.channels.channels.held == state.channels.channels.target).all()
    assert state.solution.fix.satellites >= 22
