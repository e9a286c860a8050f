"""Attitude of a table: against SciPy's rotations and interpolation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.attitude.table import AttitudeTableError, TabulatedAttitude
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.files.csv_table import Table
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternion

pytestmark = pytest.mark.verifies(
    "emulator/attitude/table.py",
    what="Attitude from a table",
    by="SciPy rotations and Slerp",
    status="validated",
)

START_NS = 1_300_000_000 * gpstime.NS_PER_S


def turning(rng):
    """Ten attitudes 10 s apart; SciPy's rotations turn vectors, so they are those from body to celestial."""
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(size=(10, 3)) * 0.05, axis=0))
    t_ns = START_NS + np.arange(10) * 10 * gpstime.NS_PER_S
    scalar_first = np.roll(turns.as_quat(), 1, axis=1)
    signs = np.where(np.arange(10) % 3 == 0, -1, 1)[:, None]  # q and -q are the same attitude
    return turns, t_ns, Table(t_ns, scalar_first * signs)


def test_between_rows_it_is_the_shortest_turn():
    turns, t_ns, table = turning(np.random.default_rng(3))
    measured = Orientation(t_ns[[0, -1]], np.full(2, -15.4), np.array(((1e-6, 2e-6), (1e-6, 2e-6))), "f")
    attitude = TabulatedAttitude(table, "x.csv", measured)
    slerp = Slerp((t_ns - START_NS) / 1e9, turns)
    for t_s in (0.0, 3.2, 47.5, 89.9):
        t = START_NS + int(t_s * 1e9)
        quaternion, rate = attitude.at(t, None)
        body_from_eme2000 = dcm_of_quaternion(quaternion) @ frames.ecef_from_eme2000(t, measured)
        assert np.abs(body_from_eme2000 - slerp(t_s).as_matrix().T).max() < 1e-9
        # The rate in body axes turns the attitude on: R(t + dt) = R(t) exp(w dt).
        step = (slerp(t_s).inv() * slerp(t_s + 0.05)).as_rotvec() / 0.05
        assert np.abs(rate - step).max() < 1e-8


def test_both_conventions_are_the_same_attitude():
    """v_body = q* v q of the one is v = q* v_body q of the other, whose quaternions are conjugate."""
    turns, t_ns, table = turning(np.random.default_rng(5))
    conjugate = Table(t_ns, table.columns * np.array((1, -1, -1, -1)))
    for t_s in (0, 20, 47, 90):
        t, own = START_NS + t_s * 10**9, turns[t_s // 10].as_matrix()
        plain = TabulatedAttitude(table, "x", convention="body_from_celestial")
        other = TabulatedAttitude(conjugate, "x", convention="celestial_from_body")
        assert plain.at(t, None)[0] == pytest.approx(other.at(t, None)[0], abs=1e-14)
        assert plain.at(t, None)[1] == pytest.approx(other.at(t, None)[1], abs=1e-14)
        if t_s % 10 == 0:
            assert np.abs(plain.body_from_eme2000(t) - own.T).max() < 1e-12
            wrong = TabulatedAttitude(table, "x", convention="celestial_from_body")
            assert np.abs(wrong.body_from_eme2000(t) - own).max() < 1e-12


def test_what_is_no_attitude_or_too_short_is_refused():
    _, t_ns, table = turning(np.random.default_rng(3))
    bad = table.columns.copy()
    bad[4] *= 1.1
    with pytest.raises(AttitudeTableError, match=r"x\.csv: row 5: quaternion has length 1\.1"):
        TabulatedAttitude(Table(t_ns, bad), "x.csv")
    with pytest.raises(AttitudeTableError, match=r"x\.csv: attitude from .*; the run is from"):
        TabulatedAttitude(table, "x.csv").check(START_NS, START_NS + 10**12, "x.csv")


def test_the_doubt_is_what_a_changing_rate_makes_between_rows():
    """About one axis, the angle's second derivative known: a chord is off by an eighth of it by the step's
    square."""
    t_s = np.delete(np.arange(0.0, 1000.0, 10.0), slice(40, 60))
    angle = 0.2 * np.sin(t_s / 60)
    quaternion = np.stack((np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle), 1)
    attitude = TabulatedAttitude(Table(START_NS + (t_s * 1e9).astype(np.int64), quaternion), "x")
    instant = START_NS + (np.array((100, 300, 300, 700)) * 10**9)
    fine, step_s = attitude.doubt_rad(int(instant[0]), int(instant[1]))
    assert step_s == 10
    assert fine == pytest.approx(0.2 / 60**2 * 10**2 / 8, rel=0.1)
    wide, step_s = attitude.doubt_rad(int(instant[2]), int(instant[3]))
    assert step_s == 210
    t = np.linspace(390, 600, 200)
    chord = np.interp(t, [390, 600], 0.2 * np.sin(np.array((390, 600)) / 60))
    assert wide > 0.5 * np.abs(0.2 * np.sin(t / 60) - chord).max()
    still = TabulatedAttitude(Table(START_NS + np.array((0, 10**12)), quaternion[[0, 0]]), "x")
    assert still.doubt_rad(START_NS, START_NS + 10**9) == (0.0, 1000.0)
