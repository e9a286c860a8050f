"""All forces against a day of GRACE-B as it flew: its precise orbit, 27 July 2010, 460 km, nearly polar."""

from __future__ import annotations

import gzip
from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.earth.constants import ROTATION_RPS, eci_to_ecef, rotation_angle_rad
from gnss_hil.emulator.files import finals
from gnss_hil.emulator.orbits import forces
from gnss_hil.emulator.orbits.dynamics import Orbit
from tests.support.outside import data_file

pytestmark = [pytest.mark.realdata, pytest.mark.slow]

EVERY = 30
"""Of the file's 10 s."""

CRAFT = {"mass_kg": 475, "drag_coefficient": 2.3, "radiation_area_m2": 5.0, "degree": 50}
ALL = ("egm2008", "sun", "moon", "drag", "radiation")


@pytest.fixture(scope="module")
def flown():
    """GPS times (n,), positions and velocities (n, 3) in the eci of a run that starts with them."""
    text = gzip.decompress(data_file("grace_b_2010-07-27/grcb_truth.csv.gz").read_bytes()).decode("ascii")
    rows = [line.split(",") for line in text.splitlines()][::EVERY]
    clock = [datetime.strptime(f"{row[0]} {row[1]}", "%d/%m/%Y %H:%M:%S") for row in rows]
    t_ns = np.array([gpstime.from_calendar(moment) for moment in clock])
    values = np.array([[float(cell) for cell in row[2:8]] for row in rows])
    pos_ecef_m, vel_ecef_mps = 1e3 * values[:, :3], 0.1 * values[:, 3:]
    measured = finals.read(data_file("environment/finals2000A.all.gz"))
    ecef_from_gcrs = frames.ecef_from_gcrs(t_ns, measured)
    eci_from_ecef = frames.eci_from_gcrs(int(t_ns[0])) @ ecef_from_gcrs.transpose(0, 2, 1)
    inertial = vel_ecef_mps + np.cross((0, 0, ROTATION_RPS), pos_ecef_m)
    return t_ns, *(np.einsum("nij,nj->ni", eci_from_ecef, v) for v in (pos_ecef_m, inertial))


def propagated(t_ns, state, names, drag_area_m2):
    """Positions (n, 3), eci [m], from a state (6,) at the first time."""
    given = scenario.Orbit(
        altitude_km=460, inclination_deg=89, forces=names, drag_area_m2=drag_area_m2, **CRAFT
    )
    start_ns = int(t_ns[0])
    path = Orbit(start_ns, state[:3], state[3:], forces.total(given, start_ns))
    ecef = np.array([path.at(int(t)).pos_ecef_m for t in t_ns])
    return eci_to_ecef(ecef, -rotation_angle_rad(t_ns, gpstime.leap_seconds(start_ns)))


@pytest.mark.verifies(
    "emulator/orbits/forces.py",
    what="Craft orbit: forces",
    by=(
        "GRACE-B as it flew on 2010-07-27: a day to 1.6 m rms (degree 50, start and drag area fitted); ISS "
        "telemetry; secular rates of node and perigee. No tides, no relativity; the pole stays that of the "
        "run's start"
    ),
    status="validated",
)
def test_the_forces_carry_grace_for_a_day(flown):
    """Start and drag area are fitted (the air of that day is not known), nothing else. What is left: tides of
    the solid Earth and the oceans, degrees above 50, the air's real course."""
    t_ns, pos, vel = flown
    state, area_m2 = np.concatenate((pos[0], vel[0])), 0.2
    steps = np.diag((10.0, 10.0, 10.0, 0.01, 0.01, 0.01))
    # What a change at the start does later is known well enough from a simpler field.
    plain = propagated(t_ns, state, ("j2",), area_m2)
    slopes = [propagated(t_ns, state + step, ("j2",), area_m2) - plain for step in steps]
    slopes.append(propagated(t_ns, state, ("j2", "drag"), area_m2) - plain)
    for _ in range(2):
        off = pos - propagated(t_ns, state, ALL, area_m2)
        *change, more = np.linalg.lstsq(np.reshape(slopes, (7, -1)).T, off.ravel(), rcond=None)[0]
        state, area_m2 = state + change @ steps, area_m2 + 0.2 * more
    miss_m = np.linalg.norm(pos - propagated(t_ns, state, ALL, area_m2), axis=1)
    rms_m = np.sqrt(np.mean(miss_m**2))
    print(f"GRACE-B, a day: {rms_m:.2f} m rms, {miss_m.max():.2f} m at most; drag area {area_m2:.2f} m^2")
    assert rms_m < 3
    assert miss_m.max() < 8
