"""A day of orbit against heyoka: adaptive Taylor integration, its own EGM2008, its own third bodies.

Same constants, same inertial frame, same ephemerides (erfa), but nothing of the emulator's code: the Sun
and the Moon enter heyoka as polynomials of time fitted here, the Earth's rotation as erfa's angle and the
IERS rate.

What is left is rounding, of which a day of Molniya makes micrometres: with its node at 110 to 116 deg the
orbit misses by 0.4 to 12 um, with the node 1e-9 deg further by 1.3 um instead of 8.0. Another processor, or
another order of a sum, gives another figure.
"""

from __future__ import annotations

from datetime import datetime

import erfa
import numpy as np
import pytest

from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.orbits.dynamics import build_orbit, state_of_elements
from tests.support.outside import peer

pytestmark = pytest.mark.verifies(
    "emulator/orbits/dynamics.py",
    what="Craft orbit: integration",
    by=(
        "heyoka (Taylor, own EGM2008, Sun and Moon): a day of low, geosynchronous, Molniya and 100 000 km "
        "orbits to 15 um; SciPy DOP853; closed two-body solution"
    ),
    status="validated",
)

hy = peer("heyoka")

START_UTC = datetime(2012, 10, 31)
START_NS = round((START_UTC - datetime(1980, 1, 6)).total_seconds() + 16) * 10**9
DAY_S = 86400.0
# WGS-84, DE430, IAU 2012.
MU_EARTH, MU_SUN, MU_MOON, AU_M = 3.986004418e14, 1.32712440041939e20, 4.902800066e12, 149_597_870_700.0
ERA_RATE_RPS = 2 * np.pi * 1.00273781191135448 / DAY_S
"""IERS Conventions (2010), eq. 5.15."""
DEGREE = 20
GRAVITY = ("egm2008", "sun", "moon")
MASS = {"mass_kg": 1000.0, "radiation_area_m2": 20.0, "radiation_coefficient": 1.3}
ORBITS = {
    "leo": {"altitude_km": 400, "inclination_deg": 51.6, "eccentricity": 0.001, "raan_deg": 40},
    "geo": {"semi_major_axis_km": 42164, "inclination_deg": 0.05, "true_anomaly_deg": 75},
    "molniya": {
        "semi_major_axis_km": (6978.137 / (1 - 0.73)),
        "eccentricity": 0.73,
        "inclination_deg": 63.4,
        "arg_perigee_deg": 270,
        "raan_deg": 110,
    },
    "highest": {
        "semi_major_axis_km": (6978.137 + 106_378.137) / 2,
        "eccentricity": (106_378.137 - 6978.137) / (106_378.137 + 6978.137),
        "inclination_deg": 28.5,
        "raan_deg": 200,
        "true_anomaly_deg": 150,
    },
}


def tt(t_s):
    """Two-part Julian date (TT) of times (n,) [s] after the start, by erfa's own tables."""
    start = START_UTC
    utc = erfa.dtf2d("UTC", start.year, start.month, start.day, start.hour, start.minute, float(start.second))
    day, rest = erfa.taitt(*erfa.utctai(*utc))
    return np.broadcast_to(day, np.shape(t_s)), rest + np.asarray(t_s) / DAY_S


def bodies_eci(t_s):
    """Sun and Moon (n, 3) [m] in the intermediate frame of the start."""
    to_eci = erfa.c2i06a(*tt(0.0))
    sun = -AU_M * erfa.epv00(*tt(t_s))[0]["p"]
    moon = AU_M * erfa.moon98(*tt(t_s))["p"]
    return sun @ to_eci.T, moon @ to_eci.T


def as_expressions(values_at):
    """Chebyshev expressions of heyoka's time [s] for a vector function, over the day and a little more."""
    fit = np.polynomial.Chebyshev.interpolate
    low, high = -0.05 * DAY_S, 1.05 * DAY_S
    x = (hy.time - (low + high) / 2) * (2 / (high - low))
    basis = [hy.expression(1.0), x]
    while len(basis) < 20:
        basis.append(2.0 * x * basis[-1] - basis[-2])
    series = [
        fit(lambda t, axis=axis: values_at(np.atleast_1d(t))[:, axis], 19, domain=(low, high))
        for axis in range(3)
    ]
    probe = np.linspace(0, DAY_S, 50)
    assert np.abs(np.stack([s(probe) for s in series], 1) - values_at(probe)).max() < 0.02
    return [hy.sum([c * b for c, b in zip(s.coef, basis, strict=True)]) for s in series]


def pull(mu, away, body):
    """Third body's acceleration, relative to the Earth's."""
    d3 = hy.sum([a * a for a in away]) ** 1.5
    b3 = hy.sum([b * b for b in body]) ** 1.5
    return [mu * (a / d3 - b / b3) for a, b in zip(away, body, strict=True)]


@pytest.fixture(scope="module")
def taylor():
    """Integrators by whether sunlight presses (par[0]: coefficient times area over mass), no shadow."""
    x, y, z, vx, vy, vz = hy.make_vars("x", "y", "z", "vx", "vy", "vz")
    era = float(erfa.era00(*erfa.dtf2d("UTC", START_UTC.year, START_UTC.month, START_UTC.day, 0, 0, 0.0)))
    angle = era + ERA_RATE_RPS * hy.time
    cos, sin = hy.cos(angle), hy.sin(angle)
    fixed = [cos * x + sin * y, cos * y - sin * x, z]
    ax, ay, az = hy.model.egm2008_acc(fixed, DEGREE, DEGREE, mu=MU_EARTH)
    acc = [[cos * ax - sin * ay, sin * ax + cos * ay, az]]
    sun, moon = (as_expressions(lambda t, which=which: bodies_eci(t)[which]) for which in (0, 1))
    for mu, body in ((MU_SUN, sun), (MU_MOON, moon)):
        acc.append(pull(mu, [b - p for b, p in zip(body, (x, y, z), strict=True)], body))
    from_sun = [p - b for b, p in zip(sun, (x, y, z), strict=True)]
    cube = hy.sum([a * a for a in from_sun]) ** 1.5
    acc.append([hy.par[0] * 4.56e-6 * AU_M**2 * a / cube for a in from_sun])
    equations = [(x, vx), (y, vy), (z, vz)]
    equations += [
        (v, hy.sum(list(parts))) for v, parts in zip((vx, vy, vz), zip(*acc, strict=True), strict=True)
    ]
    return hy.taylor_adaptive(equations, [1.0] * 6, pars=[0.0], compact_mode=True, tol=1e-16)


def judged(taylor, orbit, area_m2pkg, times_s):
    """Positions (n, 3) in ECEF [m] by heyoka."""
    taylor.time = 0.0
    taylor.state[:] = np.concatenate(state_of_elements(orbit))
    taylor.pars[:] = [area_m2pkg]
    states = taylor.propagate_grid(times_s)[-1]
    angle = erfa.era00(*erfa.dtf2d("UTC", START_UTC.year, START_UTC.month, START_UTC.day, 0, 0, 0.0))
    angle = angle + ERA_RATE_RPS * times_s
    x, y, z = states[:, :3].T
    return np.stack((np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x, z), 1)


def miss_m(taylor, name, forces, area_m2pkg=0.0):
    """Largest distance [m] between the two over a day."""
    orbit = scenario.Orbit(**ORBITS[name], **MASS, forces=forces, degree=DEGREE)
    times_s = np.linspace(0, DAY_S, 49)
    path = build_orbit(orbit, START_NS)
    ours = np.array([path.at(START_NS + round(t * 1e9)).pos_ecef_m for t in times_s])
    distance = np.linalg.norm(ours - judged(taylor, orbit, area_m2pkg, times_s), axis=1)
    print(f"{name} {forces}: {distance.max():.2e} m")
    return distance.max()


@pytest.mark.parametrize(
    "name, bound_m", [("leo", 1e-3), ("geo", 1e-4), ("molniya", 1e-3), ("highest", 1e-3)]
)
def test_a_day_under_gravity_sun_and_moon(taylor, name, bound_m):
    assert miss_m(taylor, name, GRAVITY) < bound_m


def test_a_geosynchronous_day_in_sunlight(taylor):
    """On 31 October the Earth's shadow passes 14 deg south of the orbit's plane: the whole day is lit."""
    assert miss_m(taylor, "geo", (*GRAVITY, "radiation"), 1.3 * 20.0 / 1000.0) < 1e-4
