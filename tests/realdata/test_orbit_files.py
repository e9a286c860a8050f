"""Orbits and attitudes of real craft from their files: what the tables hold besides judges the reading."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.attitude.table import COLUMNS, TabulatedAttitude
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.earth.constants import ROTATION_RPS
from gnss_hil.emulator.files import csv_table, oem, tle
from gnss_hil.emulator.orbits import tabulated, trajectory
from gnss_hil.emulator.orbits.tabulated import Wanted
from gnss_hil.emulator.orbits.trajectory import Trajectory
from tests.support.outside import data_file

pytestmark = pytest.mark.realdata

ISS_2021 = "iss_2021-06-10/iss_sc_v01.{}.20210610.csv.gz"


def test_the_stations_ephemeris_message_moves_as_it_says():
    """NASA's OEM of 2025, EME2000, 4 min apart: velocities by the positions alone against its own."""
    path = data_file("orbits/ISS.OEM_J2K_EPH.xml.gz")
    message = oem.read(path)
    orbit = tabulated.of_ephemeris(message, Wanted(str(path)))
    off = []
    for row in range(100, 1300, 40):
        t_ns = int(message.t_ns[row])
        state = orbit.at(t_ns)
        inertial = state.vel_ecef_mps + np.cross((0, 0, ROTATION_RPS), state.pos_ecef_m)
        off.append(np.linalg.norm(frames.ecef_from_eme2000(t_ns).T @ inertial - message.vel_mps[row]))
    print(f"ISS OEM: velocity from positions {np.median(off):.4f} m/s median, {max(off):.4f} at most")
    assert max(off) < 0.02


def test_positions_left_out_of_it_are_found_again():
    path = data_file("orbits/ISS.OEM_J2K_EPH.xml.gz")
    message = oem.read(path)
    whole = tabulated.of_ephemeris(message, Wanted(str(path)))
    t_ns = message.t_ns[:400]
    kept = np.ones(len(t_ns), bool)
    kept[50::60] = False
    place = np.array([whole.at(int(t)).pos_ecef_m for t in t_ns])
    gappy = Trajectory(t_ns[kept], place[kept])
    off = [np.linalg.norm(gappy.at(int(t)).pos_ecef_m - p) for t, p in
           zip(t_ns[~kept], place[~kept], strict=True)]  # fmt: skip
    print(f"ISS OEM: a state left out is found to {max(off):.3f} m")
    assert max(off) < 2.0


def test_the_station_turns_as_its_gyros_said():
    table = csv_table.read(data_file(ISS_2021.format("attitude.ck")), COLUMNS)
    rates = csv_table.read(data_file(ISS_2021.format("attitude.ck")), [f"rate_{a}" for a in "xyz"])
    attitude = TabulatedAttitude(table, "ck")
    middle = (table.t_ns[:-1] + table.t_ns[1:]) // 2
    ours = np.array([attitude.at(int(t), None)[1] for t in middle])
    said = (rates.columns[:-1] + rates.columns[1:]) / 2
    off = np.rad2deg(np.linalg.norm(ours - said, axis=1))
    print(f"ISS 2021: rates from quaternions {np.median(off) * 3600:.1f} arcsec/s median from telemetry")
    assert np.median(off) < 5e-4
    assert np.rad2deg(np.linalg.norm(said, axis=1)).min() > 0.06  # an orbit's rate: what is told apart


def test_two_line_elements_carry_the_gps_satellites_of_a_day(tmp_path):
    """TLE set of 2012-11-01 against the broadcast orbits of the day before: 2.7 km in the median when others
    compared them. Some sets are old or of manoeuvring satellites."""
    from gnss_hil.emulator.constellation.broadcast import gps
    from gnss_hil.emulator.files import rinex_nav

    moment = gpstime.from_calendar(datetime(2012, 10, 31, 12, 0, 30))
    records = rinex_nav.read(data_file("navigation/brdc3050.12n.gz")).records["G"]
    sky = gps.from_records(records)
    place, _, said = sky.sample(np.array([moment]), np.zeros(1))
    path = data_file("orbits/TLE_GNSS_20121101.txt")
    by_name = {s.name: s for s in tle.read(path)}
    off_km = []
    for column, index in enumerate(sky.index % 64):
        named = [s for name, s in by_name.items() if f"PRN {index:02d}" in name or name == f"G{index:02d}"]
        if named and said.available[0, column]:
            orbit = trajectory.of_elements(named[0].line1, named[0].line2, moment, moment + 10**9)
            off_km.append(np.linalg.norm(orbit.at(moment).pos_ecef_m - place[0, 0, column]) / 1e3)
    print(f"TLE of {len(off_km)} GPS satellites: {np.median(off_km):.2f} km median from broadcast")
    assert len(off_km) > 25
    assert np.median(off_km) < 4.0
