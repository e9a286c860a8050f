"""The whole flight software on a fake bus."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.frames import EMPTY, concat
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.state import heartbeat, initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.io.frame_statistics import Reason
from gnss_hil.flightsw.records.solution import NoFix
from tests.flightsw.estimation.test_position import craft
from tests.support import synthetic_epochs as s
from tests.support.flown import AUTO, CODEC, FakeBus, decoded, mark_frames, position_of

pytestmark = [
    pytest.mark.verifies(
        "flightsw/estimation/all_in_view.py",
        "flightsw/estimation/snapshot.py",
        what="The prototype's and the patent's fix: all antennas together",
        by="measurements made in an inertial frame by separate code, through frames",
        status="validated",
    ),
    pytest.mark.verifies(
        "flightsw/app/step.py",
        "flightsw/app/state.py",
        what="One epoch of the flight software, and what it keeps",
        by=(
            "rules of ours, flown epoch by epoch: takeover, handover, lost commands, restarts, other "
            "sessions, damaged frames; the same frames give the same bytes"
        ),
        status="modelled",
    ),
]

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
SKY = s.constellation()
TRACK, AUTONOMOUS = (raw_of("Action")[word] for word in ("TRACK", "AUTONOMOUS"))


def soyuz(rate=(0.0, -0.00113, 0.0), **more):
    return replace(craft(levers=SOYUZ.lever_arm_body_m, **more), rate_body=np.array(rate))


def fly(bus, config, epochs, state=None, first=0, tamper=lambda epoch, block: block, answer=EMPTY):
    """States, answers and blocks of consecutive epochs."""
    state = initial_state(config) if state is None else state
    states, answers, blocks = [], [], []
    for epoch in range(first, first + epochs):
        block = tamper(epoch, bus.block(epoch, answer))
        state, answer = flight_step(config, state, block)
        states.append(state)
        answers.append(answer)
        blocks.append(block)
    return states, answers, blocks


@pytest.fixture(scope="module")
def flight():
    """Twelve epochs of the patent's policy from a cold start."""
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "patent", {})
    return bus, config, *fly(bus, config, 12)


def error_m(c, answer, t):
    return np.linalg.norm(position_of(answer) - s.truth_ecef(c, float(t))[0])


def status(answer, name):
    return int(decoded(answer, "NAV_STATUS")[name][0])


def used(answer):
    """(receiver, channel) in the fix, from NAV_USED."""
    v = decoded(answer, "NAV_USED")
    pairs = zip(v["receiver"].tolist(), v["channels"].tolist(), strict=True)
    return {(receiver, k) for receiver, mask in pairs for k in range(32) if mask >> k & 1}


def tracked(block):
    """(receiver, channel) -> satellite, from the SV_CLOCK frames of a block."""
    rows = block[CODEC.kind_of[block.can_id] == CODEC.kinds["SV_CLOCK"].number]
    v = CODEC.decode("SV_CLOCK", rows.data)
    sats = (64 * v["sat_system"] + v["sat_number"]).tolist()
    return dict(
        zip(zip(CODEC.number_of[rows.can_id].tolist(), v["channel"].tolist(), strict=True), sats, strict=True)
    )


def test_fix_is_true_to_the_bus(flight):
    bus, _, _, answers, _ = flight
    errors = [error_m(bus.craft, answer, t) for t, answer in enumerate(answers)]
    # The bus rounds ranges and satellites to 1 mm: 0.6 mm a measurement, times the dilution.
    dilution = [decoded(answer, "NAV_STATUS")["pdop"][0] for answer in answers]
    assert (np.array(errors) < 0.003 * np.array(dilution) + 0.001).all()
    assert max(errors[-5:]) < 0.004
    v = np.array([decoded(answers[-1], f"NAV_V{axis}")[f"v{axis.lower()}_mps"][0] for axis in "XYZ"])
    assert np.linalg.norm(v - s.truth_ecef(bus.craft, 11.0)[1]) < 2e-3


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


def test_answer_block_order_and_protection(flight):
    *_, answers, _ = flight
    kinds = [CODEC.layouts[k].name for k in CODEC.kind_of[answers[1].can_id]]
    expected = ["NAV_STATUS", *(f"NAV_{v}{a}" for v in ("", "V") for a in "XYZ"), "NAV_CLOCK", "NAV_CLOCK",
                "NAV_DRIFT", "NAV_DRIFT", "NAV_SIGMA", "NAV_CORR", *["NAV_USED"] * 4,
                "NAV_VSIGMA", "NAV_VCORR", "NAV_CLOCK_SIGMA", "NAV_CLOCK_SIGMA", "NAV_STATE"]  # fmt: skip
    assert kinds[: len(expected)] == expected
    assert set(kinds[len(expected) : -1]) == {"COMMAND"} and kinds[-1] == "HEARTBEAT"
    counters = e2e.fresh_counters(CODEC)
    for answer in answers:
        screened = screening.screen(CODEC, answer, counters)
        counters = screened.counters
        assert (screened.verdict == screening.Verdict.OK).all()
    assert (answers[3].data[:, 1] >> 4 == 3).all() and (answers[3].t_ns == s.T0_NS + 3 * 10**9).all()


def test_navigation_frames_say_what_the_fix_says(flight):
    _, _, states, answers, _ = flight
    fix, answer = states[-1].solution.fix, answers[-1]
    assert position_of(answer) == pytest.approx(fix.position_m, abs=0.00051)
    clocks = decoded(answer, "NAV_CLOCK")
    assert tuple(clocks["item"].tolist()) == fix.items
    assert clocks["bias_m"] == pytest.approx(fix.clock_m, abs=0.00051)
    assert decoded(answer, "NAV_DRIFT")["drift_mps"] == pytest.approx(fix.drift_mps, abs=0.000051)
    sigma = np.sqrt(np.diag(fix.covariance_m2))
    v = decoded(answer, "NAV_SIGMA")
    assert [v[f"sigma_{a}_m"][0] for a in "xyz"] == pytest.approx(sigma, abs=0.0051)
    v = decoded(answer, "NAV_CORR")
    correlation = fix.covariance_m2 / np.outer(sigma, sigma)
    expected = [correlation[0, 1], correlation[0, 2], correlation[1, 2]]
    assert [v[f"rho_{p}"][0] for p in ("xy", "xz", "yz")] == pytest.approx(expected, abs=0.00006)
    sigma = np.sqrt(np.diag(fix.velocity_covariance_m2ps2))
    v = decoded(answer, "NAV_VSIGMA")
    assert [v[f"sigma_v{a}_mps"][0] for a in "xyz"] == pytest.approx(sigma, abs=0.00051)
    v = decoded(answer, "NAV_VCORR")
    correlation = fix.velocity_covariance_m2ps2 / np.outer(sigma, sigma)
    expected = [correlation[0, 1], correlation[0, 2], correlation[1, 2]]
    assert [v[f"rho_v{p}"][0] for p in ("xy", "xz", "yz")] == pytest.approx(expected, abs=0.00006)
    v = decoded(answer, "NAV_CLOCK_SIGMA")
    assert tuple(v["item"].tolist()) == fix.items
    assert v["sigma_bias_m"] == pytest.approx(np.sqrt(fix.clock_variance_m2), abs=0.00051)
    assert v["sigma_drift_mps"] == pytest.approx(np.sqrt(fix.drift_variance_m2ps2), abs=0.000051)


def test_same_frames_same_bytes(flight):
    _, config, _, answers, blocks = flight
    state = initial_state(config)
    for block, answer in zip(blocks, answers, strict=True):
        state, again = flight_step(config, state, block)
        assert again == answer


def test_heartbeat_before_the_first_epoch():
    config = configure(SOYUZ, "patent", boot_count=5)
    beat = heartbeat(config)
    v = decoded(beat, "HEARTBEAT")
    assert (v["state"][0], v["boot_count"][0], v["contract_hash"][0], v["e2e_counter"][0]) == (
        1,
        5,
        CODEC.hash,
        0,
    )
    assert heartbeat(config) == beat
    _, answer = flight_step(config, initial_state(config), EMPTY)
    both = screening.screen(CODEC, concat([beat, answer]), e2e.fresh_counters(CODEC))
    assert (both.verdict == screening.Verdict.OK).all(), "the first epoch's heartbeat follows on from it"


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


def drop(kinds, epochs):
    numbers = [CODEC.kinds[kind].number for kind in kinds]
    return lambda epoch, block: (
        block[~np.isin(CODEC.kind_of[block.can_id], numbers)] if epoch in epochs else block
    )


@pytest.mark.slow
def test_without_attitude_no_fix_and_no_new_command_unless_held():
    gone = range(6, 8)
    for hold, expected in ((0, NoFix.NO_ATTITUDE), (3, NoFix.FIX)):
        bus = FakeBus(soyuz(rate=(0.03, 0, 0)), SKY)
        config = configure(SOYUZ, "patent", {"attitude_hold_epochs": hold})
        states, answers, _ = fly(bus, config, 12, tamper=drop(["ATT_Q01"], gone))
        assert {status(answers[k], "no_fix") for k in gone} == {expected}
        assert status(answers[8], "no_fix") == NoFix.FIX
        if hold:
            assert max(error_m(bus.craft, answers[k], k) for k in gone) < 0.01
        else:
            permitted = [states[k].channels.satellites.permitted for k in range(5, 8)]
            assert all(np.array_equal(p, permitted[0]) for p in permitted)


def test_without_a_time_mark_nothing_is_used(flight):
    _, config, *_ = flight
    _, answers, _ = fly(FakeBus(soyuz(), SKY), config, 4, tamper=drop(["TIME_FINE"], [2]))
    assert status(answers[2], "no_fix") == NoFix.NO_TIME_MARK
    assert [status(answers[k], "no_fix") for k in (0, 1, 3)] == [0, 0, 0]


@pytest.mark.slow
def test_long_without_a_fix_receivers_search_again_then_all_recovers():
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "patent", {"autonomy_after_epochs": 4})
    _, answers, _ = fly(bus, config, 24, tamper=drop(["RANGE"], range(8, 14)))
    assert {status(answers[k], "no_fix") for k in range(8, 14)} == {NoFix.TOO_FEW_SATELLITES}
    freed = {epoch for epoch, *_, action, _ in bus.commands if action == AUTONOMOUS}
    assert freed == {12}
    assert status(answers[-1], "satellites") >= 22
    assert error_m(bus.craft, answers[-1], 23) < 0.004


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
def test_a_restarted_receivers_delay_is_forgotten_in_that_epoch():
    """By its boot count on the bus."""
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "prototype", {})
    states, _, _ = fly(bus, config, 12)
    bus.boots[2] += 1
    later, _, _ = fly(bus, config, 3, states[-1], first=12)
    against = np.array([-1, -1, 3, -1.0]) / 3
    known = [against @ state.nav.delays.root_m for state in (states[-1], *later)]
    variance = [row @ row for row in known]
    assert variance[0] < 0.5 * config.budget.delay_m**2 < config.budget.delay_m**2 < variance[1]
    assert variance[3] < variance[1] + 0.01, "once"
    assert all(state.solution.fix is not None for state in later)


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


def test_new_session_starts_fresh(flight):
    _, config, states, *_ = flight
    bus = FakeBus(soyuz(), SKY, session=8)
    again, answers, _ = fly(bus, config, 1, states[-1])
    _, expected, _ = fly(FakeBus(soyuz(), SKY, session=8), config, 1)
    assert answers == expected and again[0].mark.session == 8


def test_limits_of_the_vehicle_file_are_flown():
    """By AUTOSAR's letter a stream is used when it is valid, here after three sound epochs: the mark too."""
    wary = replace(SOYUZ, protection=Protection(min_ok_state_init=2, min_ok_state_invalid=2,
                   max_error_state_init=8, max_error_state_invalid=8, use_state_init=False))  # fmt: skip
    states, _, blocks = fly(FakeBus(soyuz(), SKY), configure(wary, "patent", {}), 4)
    assert [state.solution.fix is not None for state in states] == [False, False, True, True]
    assert states[-1].rejected[Reason.STREAM_NOT_VALID].sum() >= len(blocks[0])
    again, *_ = fly(FakeBus(soyuz(), SKY, session=8), configure(wary, "patent", {}), 4, states[-1])
    assert [state.solution.fix is not None for state in again] == [False, False, True, True]


def test_new_session_keeps_what_was_counted(flight):
    _, config, states, _, blocks = flight
    noisy, _ = flight_step(config, states[-1], concat([blocks[-1][:40], blocks[-1][:40]]))
    counted = noisy.rejected.copy()
    assert counted.sum() > 40
    again, _ = flight_step(config, replace(noisy, lost=3), FakeBus(soyuz(), SKY, session=8).block(0))
    assert np.array_equal(again.rejected, counted) and again.lost == 3 and again.mark.session == 8


@pytest.mark.parametrize("epoch", [11, 27, 40], ids=["this epoch's nibble", "likewise", "another"])
@pytest.mark.parametrize("counter", range(15))
@pytest.mark.parametrize("place", [0, 1, 3, -1])
def test_stray_time_mark_of_another_session_costs_nothing(flight, place, counter, epoch):
    _, config, states, answers, blocks = flight
    stray, _ = e2e.protect(CODEC, mark_frames(epoch, s.T0_NS, session=8)[0], e2e.fresh_counters(CODEC), epoch)
    stray.data[0, 1] = stray.data[0, 1] & 0xF0 | counter
    stray.data[0, 0] = e2e.crc(stray.can_id, stray.data)[0]
    block = blocks[-1]
    place %= len(block)
    state, answer = flight_step(config, states[-2], concat([block[:place], stray, block[place:]]))
    told = answer.can_id == CODEC.can_id_of["NAV_REFUSED", 0]
    assert answer[~told] == answers[-1]
    assert CODEC.decode("NAV_REFUSED", answer[told].data)["reason"].tolist() == [Reason.OTHER_SESSION]
    assert np.array_equal(state.received.counters, states[-1].received.counters)
    assert int(state.rejected.sum() - states[-1].rejected.sum()) == 1


def test_wrong_range_rates_give_a_position_without_velocity(flight):
    bus, config, states, _, blocks = flight
    block, data = blocks[-1], blocks[-1].data.copy()
    rows = np.flatnonzero(CODEC.kind_of[block.can_id] == CODEC.kinds["RATE"].number)[::3]
    for k, row in enumerate(rows.tolist()):
        data[row, 2:] = CODEC.encode(
            "RATE",
            {"channel": data[row, 2] & 31, "range_rate_mps": 900.0 * (k - 3), "cn0_dbhz": 45, "lock": 5},
        )[0, 2:]
        data[row, 0] = e2e.crc(block.can_id[row : row + 1], data[row : row + 1])[0]
    state, answer = flight_step(config, states[-2], replace(block, data=data))
    assert status(answer, "mode") == 1 and error_m(bus.craft, answer, 11) < 0.004
    kinds = {CODEC.layouts[k].name for k in CODEC.kind_of[answer.can_id]}
    assert not kinds & {"NAV_VX", "NAV_VY", "NAV_VZ", "NAV_DRIFT"} and "NAV_CLOCK" in kinds
    # What carries the position on is the velocity from before; J2, which this sky lacks, is 0.01 m/s^2.
    assert np.linalg.norm(state.solution.orbit.velocity_mps - s.truth_ecef(bus.craft, 11.0)[1]) < 0.02
    # Without any from before the position leads nowhere: the next epoch starts without one.
    cold, _ = flight_step(config, initial_state(config), replace(block, data=data))
    assert cold.solution.fix is not None and cold.solution.orbit.velocity_mps is None
    mark, _ = e2e.protect(CODEC, concat(mark_frames(12, s.T0_NS + 12 * 10**9)), cold.received.counters, 12)
    coasting = flight_step(config, state, mark)[0].solution.orbit
    assert (coasting.t_ns, coasting.fix_ns) == (s.T0_NS + 12 * 10**9, s.T0_NS + 11 * 10**9)
    assert flight_step(config, cold, mark)[0].solution.orbit is None


def test_corrupted_channel_is_out_of_the_fix_and_the_others_stay(flight):
    _, config, states, answers, blocks = flight
    receiver, channel = sorted(used(answers[-1]))[3]
    block = blocks[-1]
    row = np.flatnonzero(block.can_id == CODEC.can_id_of["SV_Z", receiver])
    row = row[block.data[row, 2] & 31 == channel][0]
    data = block.data.copy()
    data[row, 6] ^= 1
    state, answer = flight_step(config, states[-2], replace(block, data=data))
    assert used(answer) == used(answers[-1]) - {(receiver, channel)}
    assert state.solution.fix is not None


@pytest.mark.parametrize(("ura", "enters"), [(-16, False), (-15, True), (14, True), (15, False)])
def test_what_promises_no_accuracy_stays_out(flight, ura, enters):
    """15 and -16 are no prediction, use at own risk: IS-GPS-200, 30.3.3.1.1.4."""
    _, config, states, answers, blocks = flight
    epoch = blocks[-1]
    row = np.flatnonzero(epoch.can_id == CODEC.can_id_of["SV_VZ", 1])[0]
    bits = CODEC.kinds["SV_VZ"]
    shift = int(bits.shift[bits.signals.index("ura")])
    data = epoch.data.copy()
    word = int(data[row].view("<u8")[0]) & ~(31 << shift) | (ura & 31) << shift
    data[row] = np.array([word], "<u8").view(np.uint8)
    data[row, 0] = e2e.crc(epoch.can_id[row : row + 1], data[row : row + 1])[0]
    _, answer = flight_step(config, states[-2], replace(epoch, data=data))
    left_out = set() if enters else {(1, int(data[row, 2] & 31))}
    assert used(answers[-1]) - used(answer) == left_out


def test_unhealthy_and_unlocked_channels_stay_out(flight):
    _, config, states, answers, _ = flight
    epoch = flight[4][-1]
    row = np.flatnonzero(epoch.can_id == CODEC.can_id_of["SV_Z", 1])[0]
    bits = CODEC.kinds["SV_Z"]
    data = epoch.data.copy()
    word = int(data[row].view("<u8")[0]) | 1 << int(bits.shift[bits.signals.index("health")])
    data[row] = np.array([word], "<u8").view(np.uint8)
    data[row, 0] = e2e.crc(epoch.can_id[row : row + 1], data[row : row + 1])[0]
    state, answer = flight_step(config, states[-2], replace(epoch, data=data))
    assert used(answers[-1]) - used(answer) == {(1, int(data[row, 2] & 31))}
    permitted, before = (one.channels.satellites.permitted for one in (state, states[-1]))
    (unhealthy,) = np.flatnonzero(~state.predictions.healthy & states[-1].predictions.healthy)
    assert before[unhealthy] >= 0 and permitted[unhealthy] < 0


@pytest.mark.parametrize(
    ("policy", "options", "line"),
    [
        ("best", {}, "policy 'best': not known; there are patent, prototype, analogue, single"),
        (
            "patent",
            {"hysteresis": 3},
            "hysteresis: unknown option; there are attitude_hold_epochs, auto",
        ),
        (
            "patent",
            {"hysteresis_deg": -1},
            "hysteresis_deg: input should be greater than or equal to 0, found -1",
        ),
        ("patent", {"overflow": "bump"}, "overflow: input should be 'drop' or 'next', found 'bump'"),
        ("prototype", {"overflow": "drop"}, "policy 'prototype', navigator 'all_in_view': overflow: unknown"),
    ],
)
def test_mistakes_in_options_get_one_line(policy, options, line):
    with pytest.raises(ValueError) as caught:
        configure(SOYUZ, policy, options)
    assert line in str(caught.value) and "\n" not in str(caught.value)
