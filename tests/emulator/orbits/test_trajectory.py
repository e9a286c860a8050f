"""Tabulated orbits: against functions, published conversions, and states that their tables hold beside."""

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.files import tle
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.files.oem import Ephemeris
from gnss_hil.emulator.orbits import tabulated, trajectory
from gnss_hil.emulator.orbits.tabulated import Wanted
from gnss_hil.emulator.orbits.trajectory import Trajectory, TrajectoryError, lagrange

pytestmark = [
    pytest.mark.verifies(
        "emulator/files/oem.py",
        "emulator/files/tle.py",
        "emulator/files/csv_table.py",
        "emulator/orbits/trajectory.py",
        what="Orbits from files: OEM, two-line elements, tables",
        by="SGP4 verification case and TEME example of AIAA 2006-6753; polynomials",
        status="validated",
    ),
    pytest.mark.verifies(what="Celestial and terrestrial frames"),
]

START_NS = gpstime.from_utc(datetime(2020, 1, 1))
EARTH_RPS = 7.292115e-5


def circle(t_s):
    """A low orbit's place in turning axes, and its derivatives."""
    w, radius = 2 * np.pi / 5560, 6.79e6
    angle = np.asarray(t_s) * w
    place = radius * np.stack((np.cos(angle), np.sin(angle), 0.3 * np.sin(angle + 1)), -1)
    rate = radius * w * np.stack((-np.sin(angle), np.cos(angle), 0.3 * np.cos(angle + 1)), -1)
    return place, rate, -(w**2) * place


def test_lagrange_is_exact_for_polynomials_of_its_degree():
    t = np.sort(np.random.default_rng(1).uniform(0, 10, 24))
    values = np.stack((t**9 - 3 * t**4, 2 * t), 1)
    at = np.linspace(t[0], t[-1], 57)
    expected = np.stack((at**9 - 3 * at**4, 2 * at), 1)
    assert np.allclose(lagrange(t, values, at), expected, rtol=1e-9, atol=1e-3)
    assert np.array_equal(lagrange(t, values, t), values)


@pytest.mark.parametrize(("step_s", "limit_m"), [(60, 1e-6), (240, 0.01)])
def test_position_velocity_and_acceleration_of_a_low_orbit(step_s, limit_m):
    t_s = np.arange(0, 12_000, step_s)
    orbit = Trajectory(START_NS + t_s * gpstime.NS_PER_S, circle(t_s)[0])
    for at_s in (4001.5, 5234.0, 6000.25):
        state = orbit.at(START_NS + int(at_s * 1e9))
        place, rate, acceleration = circle(at_s)
        assert np.abs(state.pos_ecef_m - place).max() < limit_m
        assert np.abs(state.vel_ecef_mps - rate).max() < limit_m / 10
        assert np.abs(state.acc_ecef_mps2 - acceleration).max() < limit_m / 10


@pytest.mark.parametrize("rows", [10, 121, 126])
def test_a_table_is_as_good_at_its_ends(rows):
    """Also one that begins and ends in the middle of a minute: its last states are not bent to its end."""
    t_s = 42.0 + 10.0 * np.arange(rows)
    orbit = Trajectory(START_NS + (t_s * 1e9).astype(int), circle(t_s)[0])
    for at_s in (42.0, 43.5, t_s[-1] - 8.1, t_s[-1]):
        state = orbit.at(START_NS + round(at_s * 1e9))
        place, rate, _ = circle(at_s)
        assert np.abs(state.pos_ecef_m - place).max() < 1e-5
        assert np.abs(state.vel_ecef_mps - rate).max() < 1e-5


def test_teme_to_earth_fixed_is_vallados_example():
    """Vallado et al., Revisiting Spacetrack Report #3, AIAA 2006-6753, appendix C: TEME and PEF of
    2004-04-06 07:51:28.386009 UTC, UT1 - UTC = -0.4399619 s. UT1 is UTC here: the instant is that of UT1.
    Theirs is a Julian date in one number, which has steps of 40 us, 2 cm."""
    moment = gpstime.from_utc(datetime(2004, 4, 6, 7, 51, 28)) + 386_009_000 - 439_961_900
    teme = np.array([5094.18016210, 6127.64465950, 6380.34453270])
    pef = np.array([-1033.47503130, 7901.30558560, 6380.34453270])
    assert np.abs(frames.ecef_from_teme(moment) @ teme - pef).max() < 2e-5


@pytest.mark.parametrize(
    ("name", "turn"),
    [
        ("EME2000", frames.ecef_from_eme2000),
        ("J2000", frames.ecef_from_eme2000),
        ("GCRF", frames.ecef_from_gcrs),
        ("ICRF", frames.ecef_from_gcrs),
        ("TEME", frames.ecef_from_teme),
        ("ITRF2020", lambda t_ns, measured: np.eye(3)),
    ],
)
def test_every_frame_comes_to_the_earths_by_measured_orientation(name, turn):
    t_ns = START_NS + np.arange(20) * 60 * gpstime.NS_PER_S
    place = circle(np.arange(20) * 60)[0]
    measured = Orientation(t_ns[[0, -1]], np.full(2, -18.2), np.array(((1e-6, 2e-6), (1e-6, 2e-6))), "f")
    for given in (None, measured):
        orbit = tabulated.of_ephemeris(Ephemeris("X", name, t_ns, place, place), Wanted("x.oem", given))
        expected = turn(int(t_ns[7]), given) @ place[7]
        assert orbit.at(int(t_ns[7])).pos_ecef_m == pytest.approx(expected, abs=1e-5)


def test_an_unknown_frame_and_a_run_beyond_the_table_are_refused():
    t_ns = START_NS + np.arange(20) * 60 * gpstime.NS_PER_S
    table = Ephemeris("X", "MARS", t_ns, np.ones((20, 3)), np.ones((20, 3)))
    with pytest.raises(TrajectoryError, match=r"x\.oem: REF_FRAME is MARS; allowed are EME2000"):
        tabulated.of_ephemeris(table, Wanted("x.oem"))
    orbit = Trajectory(t_ns, circle(np.arange(20) * 60)[0])
    with pytest.raises(TrajectoryError, match=r"x\.oem: states from .* to .*; the run is from"):
        orbit.check(START_NS, START_NS + 86_400 * gpstime.NS_PER_S, "x.oem")


LINE1 = "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753"
LINE2 = "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667"


def test_two_line_elements_are_sgp4s_verification_case():
    """Satellite 00005 of AIAA 2006-6753 (tcppver.out), at 0 and 360 min from its epoch, TEME [km]."""
    epoch_ns = gpstime.from_utc(datetime(2000, 6, 27, 18, 50, 19)) + 733_568_000
    end_ns = epoch_ns + 400 * 60 * gpstime.NS_PER_S
    orbit = trajectory.of_elements(LINE1, LINE2, epoch_ns, end_ns)
    for minutes, place_km in (
        (0, (7022.46529266, -1400.08296755, 0.03995155)),
        (360, (-7154.03120202, -3783.17682504, -3536.19412294)),
    ):
        t_ns = epoch_ns + minutes * 60 * gpstime.NS_PER_S
        teme_km = frames.ecef_from_teme(t_ns).T @ orbit.at(t_ns).pos_ecef_m / 1e3
        assert np.abs(teme_km - place_km).max() < 2e-4  # the epoch is rounded to 10 us, 0.1 m


def test_element_sets_with_faults_are_refused():
    text = f"VANGUARD\n{LINE1}\n{LINE2}\n"
    assert [s.name for s in tle.parse(text, "x.tle")] == ["VANGUARD"]
    for bad, message in (
        (text.replace("58002B", "58003B"), r"x\.tle: line 2: checksum is '3'; the line sums up to 4"),
        (
            text.replace(LINE2, LINE2[:60]),
            r"x\.tle: line 3: not line 2 of an element set, which has 69 columns with its checksum, but 60",
        ),
        (text.replace(LINE2, "VANGUARD"), r"x\.tle: line 3: not line 2"),
        (f"{LINE1}\n", r"x\.tle: line 2 of the last set is missing"),
        ("nothing\n", r"x\.tle: no element set"),
    ):
        with pytest.raises(ValueError, match=message):
            tle.parse(bad, "x.tle")
    with pytest.raises(ValueError, match=r"x\.tle: object is 'MIR'; the file has VANGUARD"):
        tle.choose(tle.parse(text, "x.tle"), "MIR", "x.tle", START_NS)
