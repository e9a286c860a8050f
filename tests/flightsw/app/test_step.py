"""The whole flight software on a fake bus."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.frames import EMPTY, concat
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.state import heartbeat, initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.records.solution import NoFix
from tests.support import synthetic_epochs as s
from tests.support.flights import AUTONOMOUS, SKY, SOYUZ, drop, error_m, fly, soyuz, status
from tests.support.flown import CODEC, FakeBus, decoded

pytestmark = pytest.mark.verifies(
    "flightsw/app/step.py",
    "flightsw/app/state.py",
    what="One epoch of the flight software, and what it keeps",
    by="rules of ours, flown epoch by epoch; the same frames give the same bytes",
    status="modelled",
)


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
