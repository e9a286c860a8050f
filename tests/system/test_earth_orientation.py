"""A run whose craft is told in the axes of J2000 stands where the measured Earth puts it: erfa is the judge.

Instants, axes and measured values are prepared here from the published numbers, with no help of the bench.
"""

from __future__ import annotations

from datetime import datetime, timedelta

import erfa
import numpy as np
import polars as pl
import pytest
from scipy.spatial.transform import Rotation

from gnss_hil.tools.command_line.main import main

pytestmark = pytest.mark.verifies(
    "emulator/files/finals.py",
    what="Measured orientation of the Earth, from file to flown orbit and attitude",
    by=(
        "published lines of finals2000A; a run by an OEM in EME2000 and a table of attitude is erfa.c2t06a's "
        "with pole and UT1, 0.01 mm; brahe with the same file, 2001 to 2025: TEME 0.04 mm, EME2000 7 mm "
        "median (its pole of date is corrected by observation)"
    ),
    status="validated",
)

# finals2000A.all of the IERS, to the end of bulletin A's columns for UT1.
FINALS = """\
21 6 9 59374.00 I  0.171621 0.000018  0.436495 0.000034  I-0.1825979 0.0000079
21 610 59375.00 I  0.173023 0.000017  0.436097 0.000034  I-0.1819091 0.0000078
21 611 59376.00 I  0.174263 0.000017  0.435730 0.000035  I-0.1811045 0.0000075
"""
POLE_ARCSEC = np.array(((0.173023, 0.436097), (0.174263, 0.435730)))
UT1_UTC_S = np.array((-0.1819091, -0.1811045))
ARCSEC = np.pi / 648_000
# IERS Conventions (2010), 5.32 and 5.33: offsets of the pole and the origin of J2000 [mas].
XI, ETA, ALPHA = 1e-3 * ARCSEC * np.array((-16.6170, -6.8192, -14.6))

START = datetime(2021, 6, 10, 10, 1)
"""UTC; the run is told GPS time, 18 s ahead."""

SCENARIO = """\
name = "told"

[time]
start_gps = "2021-06-10T10:01:18"
duration_s = 120
epoch_interval_s = 10
{orientation}

[[craft]]
name = "told"
vehicle = "soyuz-ms.toml"
trajectory = {{oem = "told.oem"}}
attitude = {{mode = "table", file = "told.csv", convention = "body_from_celestial"}}
"""
HEAD = """\
CCSDS_OEM_VERS = 2.0
META_START
OBJECT_NAME = TOLD
REF_FRAME = {frame}
TIME_SYSTEM = UTC
META_STOP
"""
TURN = Rotation.from_euler("ZYX", (40.0, 25.0, -70.0), degrees=True)
"""Turns vectors from the body, which stands still among the stars, to the axes of J2000."""


def place_m(t_s):
    """A circular orbit of 6.79e6 m in the table's axes, at times (n,) [s] after START."""
    angle = 2 * np.pi * np.asarray(t_s) / 5560
    return 6.79e6 * np.stack((np.cos(angle), 0.6 * np.sin(angle), 0.8 * np.sin(angle)), -1)


def ecef_from_gcrs(t_s):
    """Rotations (n, 3, 3) of the measured Earth at times (n,) [s] after START."""
    day, rest = erfa.dtf2d("UTC", START.year, START.month, START.day, START.hour, START.minute, 0.0)
    rest = rest + np.asarray(t_s) / 86400
    part = (START.hour * 3600 + START.minute * 60 + np.asarray(t_s)) / 86400
    ut1_utc_s = UT1_UTC_S[0] + part * (UT1_UTC_S[1] - UT1_UTC_S[0])
    x, y = ARCSEC * (POLE_ARCSEC[0][:, None] + part * (POLE_ARCSEC[1] - POLE_ARCSEC[0])[:, None])
    return erfa.c2t06a(day, rest + (37 + 32.184) / 86400, day, rest + ut1_utc_s / 86400, x, y)


def gcrs_from_j2000():
    """The frame bias, of three small turns."""
    return np.array(((1, -ALPHA, XI), (ALPHA, 1, ETA), (-XI, -ETA, 1)))


def write(folder, frame="EME2000", orientation='orientation = "finals2000A.all"', finals=FINALS):
    """The scenario and what it names, all in one folder; the scenario's path."""
    at_s = range(-300, 480, 30)
    clock = [(START + timedelta(seconds=t)).isoformat() for t in at_s]
    states = [
        f"{time} {x:.9f} {y:.9f} {z:.9f} 0 0 0"
        for time, (x, y, z) in zip(clock, place_m(at_s) / 1e3, strict=True)
    ]
    quaternion = ",".join(f"{part:.15f}" for part in np.roll(TURN.as_quat(), 1))
    rows = ["UTC," + ",".join(f"quaternion_{part}" for part in "cxyz")]
    (folder / "told.oem").write_text(HEAD.format(frame=frame) + "\n".join(states) + "\n")
    (folder / "told.csv").write_text("\n".join(rows + [f"{time},{quaternion}" for time in clock]) + "\n")
    (folder / "finals2000A.all").write_text(finals)
    (folder / "told.toml").write_text(SCENARIO.format(orientation=orientation))
    return folder / "told.toml"


def flown(scenario):
    """Truth of a run: places (n, 3) [m] and quaternions body from ECEF (n, 4), scalar first."""
    out = scenario.parent / "run"
    assert main(["run", str(scenario), "--bus", "inline", "--out", str(out), "--no-report", "--quiet"]) == 0
    truth = pl.read_parquet(out / "truth.parquet")
    assert len(truth) == 12
    return (
        truth.select(f"{axis}_ecef_m" for axis in "xyz").to_numpy(),
        truth.select(f"q{part}_body_from_ecef" for part in range(4)).to_numpy(),
    )


@pytest.mark.parametrize("frame", ["EME2000", "GCRF"])
def test_orbit_and_attitude_are_erfas(frame, tmp_path):
    place, quaternion = flown(write(tmp_path, frame))
    t_s = 10.0 * np.arange(12)
    turn = ecef_from_gcrs(t_s)
    from_table = turn @ gcrs_from_j2000() if frame == "EME2000" else turn
    expected = np.einsum("nij,nj->ni", from_table, place_m(t_s))
    off_m = np.linalg.norm(place - expected, axis=1)
    print(f"{frame}: {1e3 * off_m.max():.3f} mm from erfa")
    assert off_m.max() < 1e-3
    # SciPy's rotation turns vectors: that of the quaternion as it stands is ECEF from body.
    ecef_from_body = Rotation.from_quat(np.roll(quaternion, -1, axis=1)).as_matrix()
    assert np.abs(ecef_from_body - turn @ gcrs_from_j2000() @ TURN.as_matrix()).max() < 1e-9


def test_without_a_file_the_craft_is_where_ut1_is_utc(tmp_path):
    """Orbit and attitude turn together: by 0.18 s about the pole, and by the pole's 0.47 arcsec."""
    (tmp_path / "plain").mkdir()
    (place, quaternion), (plain, plain_quaternion) = (
        flown(write(tmp_path)),
        flown(write(tmp_path / "plain", orientation="")),
    )
    turned = [Rotation.from_quat(np.roll(q, -1, axis=1)) for q in (quaternion, plain_quaternion)]
    between = turned[0] * turned[1].inv()
    assert between.apply(plain) == pytest.approx(place, abs=0.01)
    sine = between.as_rotvec()
    assert sine[:, 2] == pytest.approx(np.full(12, 7.292115e-5 * 0.1816), rel=1e-3)
    assert np.hypot(*sine[:, :2].T) == pytest.approx(np.full(12, 0.4695 * ARCSEC), rel=1e-3)


def test_a_file_that_ends_before_the_run_is_refused_in_one_line(tmp_path, capsys):
    scenario = write(tmp_path, finals="\n".join(FINALS.splitlines()[:2]))
    out = tmp_path / "run"
    assert main(["run", str(scenario), "--bus", "inline", "--out", str(out), "--quiet"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    told = (
        f"time.orientation: {tmp_path / 'finals2000A.all'}: the Earth's orientation from 2021-06-09T00:00:18 "
        "to 2021-06-10T00:00:18; the run is from 2021-06-10T10:01:18 to 2021-06-10T10:03:08 (GPS time)"
    )
    assert told in line
    assert not out.exists()


def test_a_file_that_is_not_there_is_refused_in_one_line(tmp_path, capsys):
    scenario = write(tmp_path, orientation='orientation = "nowhere.all"')
    assert main(["run", str(scenario), "--bus", "inline", "--out", str(tmp_path / "run"), "--quiet"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"time.orientation: {tmp_path / 'nowhere.all'}: No such file or directory" in line
