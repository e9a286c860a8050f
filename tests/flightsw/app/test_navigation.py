"""Whether fixes are true to the bus, and their frames to the fixes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from tests.support import synthetic_epochs as s
from tests.support.flights import SKY, SOYUZ, error_m, fly, soyuz, status
from tests.support.flown import CODEC, FakeBus, decoded, mark_frames, position_of

pytestmark = [
    pytest.mark.verifies(
        "flightsw/estimation/all_in_view.py",
        "flightsw/estimation/snapshot.py",
        what="The prototype's and the patent's fix: all antennas together",
        by="measurements made in an inertial frame by separate code, through frames",
        status="validated",
    ),
    pytest.mark.verifies(
        "flightsw/app/navigation.py",
        what="From measurements to a solution",
        by="rules of ours: what frames say is what the fix says",
        status="modelled",
    ),
]


def test_fix_is_true_to_the_bus(flight):
    bus, _, _, answers, _ = flight
    errors = [error_m(bus.craft, answer, t) for t, answer in enumerate(answers)]
    # The bus rounds ranges and satellites to 1 mm: 0.6 mm a measurement, times the dilution.
    dilution = [decoded(answer, "NAV_STATUS")["pdop"][0] for answer in answers]
    assert (np.array(errors) < 0.003 * np.array(dilution) + 0.001).all()
    assert max(errors[-5:]) < 0.004
    v = np.array([decoded(answers[-1], f"NAV_V{axis}")[f"v{axis.lower()}_mps"][0] for axis in "XYZ"])
    assert np.linalg.norm(v - s.truth_ecef(bus.craft, 11.0)[1]) < 2e-3


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
