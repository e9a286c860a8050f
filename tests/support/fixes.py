"""Ranges of a synthetic sky, and the fix of them."""

from __future__ import annotations

import numpy as np

from gnss_hil.flightsw.attitude.attitude import attitude_now, levers_ecef
from gnss_hil.flightsw.estimation.position import solve
from gnss_hil.flightsw.records.epoch import AttitudeReport
from gnss_hil.flightsw.records.ranges import Ranges
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET, SPACE_M

GLONASS_OFFSET = 8
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


def noise_of(cn0_dbhz, sat):
    """Variances of code and rate by C/N0, on the first signal of each satellite's system."""
    signal, cn0_hz = (sat >= 64).astype(int), 10 ** (0.1 * cn0_dbhz)
    noise = BUDGET.noise
    return noise.code_variance_m2(cn0_hz, signal), noise.rate_variance_m2ps2(cn0_hz, signal, 0.0 * cn0_hz)


def measurements(o, cn0=45.0):
    n = len(o["sat"])
    antenna, sat = o["antenna"].astype(int), o["sat"].astype(int)
    flat = np.zeros(n)
    return Ranges(
        antenna, sat, 1 << np.arange(n) % 32, o["p"], o["pdot"],
        np.array([o["x"], o["y"], o["z"]]), np.array([o["vx"], o["vy"], o["vz"]]), o["clock"], o["drift"],
        *noise_of(flat + cn0, sat), flat, flat + SPACE_M, flat, flat, flat + 1.0,
    )  # fmt: skip


def in_view(c, count, antennas=4, sats=None):
    """Pairs of antennas in turn and satellites clear of the Earth."""
    at = c.orbit.at(0.0)
    seen = [sat for sat in (sats or SKY) if s.clear(at, SKY[sat].at(-0.08))][:count]
    return [(k % antennas, sat) for k, sat in enumerate(seen)]


def fix_of(c, m, start=None, **more):
    dcm = c.dcm_body_from_eci @ s.ecef_from_eci(0.0).T
    report = AttitudeReport(s.quaternion(dcm), c.rate_body)
    lever, lever_rate = levers_ecef(attitude_now(report, None, s.T0_NS, 0), c.lever_body)
    return solve(
        m,
        lever.T[:, m.receiver],
        lever_rate.T[:, m.receiver],
        c.domain[m.receiver],
        start,
        **{"budget": BUDGET, **more},
    )


def errors(c, fix):
    position, velocity = s.truth_ecef(c)
    return np.linalg.norm(fix.position_m - position), np.linalg.norm(fix.velocity_mps - velocity)


DOMAINS = [(0, 0, 0, 0), (0, 1, 0, 1), (0, 1, 2, 2), (0, 1, 2, 3)]


def separate(domain):
    n = max(domain) + 1
    return craft(domain=domain, clock_s=(1e-3, -8e-4, 2e-4, 6e-4)[:n], rate=(1e-8, 2e-8, -3e-8, 0)[:n])
