"""Block 3: the fix against synthetic measurements made in an inertial frame."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.attitude import attitude_now, levers_ecef
from flightsw.intake import AttitudeReport, Measurements
from flightsw.position import GLONASS_OFFSET, Fix, solve
from tests.flightsw import synthetic as s

LEVERS = np.array([[2.4, 0, -1.1], [1.2, 1.0, -1.1], [-1.8, 0, -1.1], [1.2, -1.0, -1.1]])
RATE = np.array([0.01, -0.02, 0.005])
LEO, MEO, GEO = (
    s.Circle(radius, inclination, 1.0, 0.4)
    for radius, inclination in ((6_793e3, 0.9), (20_000e3, 0.9), (42_164e3, 0.01))
)
SKY = s.constellation()


def craft(orbit=LEO, domain=(0, 0, 0, 0), clock_s=(1e-3,), rate=(2e-8,), offset=3e-8, levers=LEVERS):
    return s.Craft(
        orbit, levers, s.lvlh(orbit), RATE, np.array(clock_s), np.array(rate), np.array(domain), offset
    )


def measurements(o, cn0=45.0):
    n = len(o["sat"])
    antenna = o["antenna"].astype(int)
    flat = np.zeros(n)
    return Measurements(
        antenna, np.arange(n), o["sat"].astype(int), o["p"], o["pdot"], flat + cn0, flat + 5, flat, flat,
        np.array([o["x"], o["y"], o["z"]]), np.array([o["vx"], o["vy"], o["vz"]]), o["clock"], o["drift"],
    )  # fmt: skip


def in_view(c, count, antennas=4, sats=None):
    """Pairs of antennas in turn and satellites clear of the Earth."""
    at = c.orbit.at(0.0)
    seen = [sat for sat in (sats or SKY) if s.clear(at, SKY[sat].at(-0.08))][:count]
    return [(k % antennas, sat) for k, sat in enumerate(seen)]


def fix_of(c, m, start=None):
    dcm = c.dcm_body_from_eci @ s.ecef_from_eci(0.0).T
    report = AttitudeReport(s.quaternion(dcm), c.rate_body)
    lever, lever_rate = levers_ecef(attitude_now(report, None, s.T0_NS, 0), c.lever_body)
    return solve(m, lever.T[:, m.receiver], lever_rate.T[:, m.receiver], c.domain[m.receiver], start)


def errors(c, fix):
    position, velocity = s.truth_ecef(c)
    return np.linalg.norm(fix.position_m - position), np.linalg.norm(fix.velocity_mps - velocity)


@pytest.mark.parametrize("orbit", [LEO, MEO, GEO], ids=["LEO", "MEO", "GEO"])
def test_fix_from_earths_centre_without_noise(orbit):
    c = craft(orbit)
    m = measurements(s.observe(c, in_view(c, 40), SKY))
    fix = fix_of(c, m)
    assert isinstance(fix, Fix)
    position, velocity = errors(c, fix)
    # 10 nm of rounding a range, times the dilution.
    assert position < 1e-6 * fix.pdop, position
    assert velocity < 2e-5 * fix.pdop, velocity
    assert fix.items == (0, GLONASS_OFFSET)
    assert fix.clock_m == pytest.approx([s.C * 1e-3, s.C * 3e-8], abs=1e-6 * fix.pdop)
    assert fix.drift_mps[0] == pytest.approx(s.C * 2e-8, abs=2e-5 * fix.pdop)


def test_warm_start_gives_the_same_fix_in_fewer_steps():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 16), SKY))
    cold = fix_of(c, m)
    warm = fix_of(c, m, s.truth_ecef(c)[0] + [30.0, -40.0, 20.0])
    assert warm.iterations == 2 < cold.iterations
    assert np.linalg.norm(warm.position_m - cold.position_m) < 2e-5
    assert errors(c, warm)[0] < 2e-5


def test_one_clock_for_each_domain():
    c = craft(
        domain=(0, 1, 2, 5), clock_s=(1e-3, -8e-4, 2e-4, 0, 0, 5e-7), rate=(1e-8, 2e-8, -3e-8, 0, 0, 4e-8)
    )
    m = measurements(s.observe(c, in_view(c, 24), SKY))
    fix = fix_of(c, m)
    assert fix.items == (0, 1, 2, 5, GLONASS_OFFSET)
    assert errors(c, fix)[0] < 1e-5
    assert fix.clock_m / s.C == pytest.approx([1e-3, -8e-4, 2e-4, 5e-7, 3e-8], abs=1e-13)
