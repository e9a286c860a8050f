"""Navigation records made or rewritten: evaluated by the models that precise orbits judge."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.constellation import messages
from gnss_hil.emulator.constellation.broadcast import glonass, gps
from gnss_hil.emulator.constellation.nominal import nominal_glonass, nominal_gps
from gnss_hil.emulator.constellation.nominal_messages import Stretch
from gnss_hil.emulator.constellation.registry import records_of

pytestmark = pytest.mark.verifies(
    "emulator/constellation/messages.py",
    "emulator/constellation/nominal_messages.py",
    what="Navigation records in use, or made for nominal satellites",
    by=(
        "RTKLIB finds the craft with them; SciPy DOP853 in inertial axes; the user algorithms that ESA "
        "orbits judge"
    ),
    status="validated",
)

START_NS = gpstime.from_calendar(datetime(2012, 10, 31, 0, 15))
MINUTE_NS = 60 * gpstime.NS_PER_S


def moments(minutes: int) -> np.ndarray:
    return START_NS + MINUTE_NS * np.arange(minutes + 1)


@pytest.mark.parametrize("start_ns", [START_NS, gpstime.from_week(1712, 604_800 - 1800)])
def test_nominal_gps_comes_out_of_its_elements_exactly(start_ns):
    """By IS-GPS-200's user algorithm, through the end of a week as well."""
    sky = nominal_gps(start_ns)
    stretch = Stretch(start_ns, start_ns + 6 * 3600 * gpstime.NS_PER_S)
    made = gps.from_records(records_of("gps", sky, stretch))
    times = np.arange(start_ns, stretch.end_ns, 10 * MINUTE_NS)
    nodes = np.array((-0.08, 0.0))
    (place, clock, broadcast), (wanted, wanted_clock, _) = made.sample(times, nodes), sky.sample(times, nodes)
    assert broadcast.available.all() and broadcast.healthy.all()
    assert np.abs(place - wanted).max() < 1e-6
    assert np.abs(clock - wanted_clock).max() < 1e-6


def flown(record: np.ndarray, extra: np.ndarray, age_s: np.ndarray) -> np.ndarray:
    """Positions (k, 3) of a GLONASS record by SciPy, in inertial axes: ICD 5.1, A.3.1.2, written anew."""
    w = 7.292115e-5
    spin = np.array((0, 0, w))

    def pull(t, y):
        position, r = y[:3], np.linalg.norm(y[:3])
        sine = position[2] / r
        oblate = 1.5 * 1_082_625.75e-9 * (6_378_136.0 / r) ** 2
        shape = np.array((1 - 5 * sine**2, 1 - 5 * sine**2, 3 - 5 * sine**2))
        angle = w * t  # the extra acceleration turns with the Earth
        turn = np.array(((np.cos(angle), -np.sin(angle), 0), (np.sin(angle), np.cos(angle), 0), (0, 0, 1)))
        return np.r_[y[3:], -398_600.4418e9 * position / r**3 * (1 + oblate * shape) + turn @ extra]

    start = np.r_[record[:3], record[3:] + np.cross(spin, record[:3])]
    out = []
    for age in age_s:
        y = solve_ivp(pull, (0, age), start, "DOP853", rtol=1e-12, atol=1e-6).y[:3, -1]
        c, s = np.cos(w * age), np.sin(w * age)
        out.append((c * y[0] + s * y[1], c * y[1] - s * y[0], y[2]))
    return np.array(out)


@pytest.mark.parametrize(("minutes", "limit_m"), [(7, 0.03), (30, 0.2)])
def test_nominal_glonass_is_followed_as_well_as_a_message_can(minutes, limit_m):
    """Circles are no solutions of the messages' equations; a constant acceleration leaves a cubic: J2's pull
    of 6e-5 m/s^2 turns with twice the satellite, 2 n, so 2e-8 m/s^3 (450 s)^3 / 24 is 0.08 m."""
    sky = nominal_glonass(START_NS)
    made = records_of("glonass", sky, Stretch(START_NS, START_NS + minutes * MINUTE_NS))
    tb_ns = np.array([gpstime.from_utc(moment) for moment in made.epoch])
    fields = made.fields
    worst = 0.0
    for row in range(0, len(made), 11):
        state = 1e3 * np.array(
            [fields[n][row] for n in ("x_km", "y_km", "z_km", "vx_kmps", "vy_kmps", "vz_kmps")]
        )
        extra = 1e3 * np.array([fields[f"a{a}_kmps2"][row] for a in "xyz"])
        ages_s = np.arange(-450, 451, 90)
        served = tb_ns[row] + ages_s * gpstime.NS_PER_S
        ages_s = ages_s[(served >= START_NS) & (served <= START_NS + minutes * MINUTE_NS)]
        place, _, _ = sky.sample(np.array([tb_ns[row]]), ages_s.astype(float))
        column = (sky.index % 64).tolist().index(made.number[row])
        worst = max(worst, np.abs(flown(state, extra, ages_s) - place[0, :, column]).max())
    assert worst < limit_m


@pytest.mark.parametrize(("row", "limit_m"), [(0, 1e-2), (1, 5e-4), (2, 5e-4)])
def test_a_record_in_wgs84_flies_where_pz90_puts_it(row, limit_m):
    """Both integrated for 15 minutes, where a new origin alone would cost 3 mm; the first datum has another
    scale, and what that changes of the Earth's pull turns with the satellite: 7 mm."""
    state = np.array([[7003008.789, -12206626.953, 21280765.625, 783.5417, 2804.2530, 1352.5150]])
    extra = np.array([[0.0, 1.7e-6, -5.41e-6]])  # ICD 5.1, A.3.1.2, example
    datum = np.array([row])
    moved, pull = messages.in_wgs84(state, extra, datum)
    for age_s in (np.array([-900.0]), np.array([900.0])):
        there = glonass.to_wgs84(flown(state[0], extra[0], age_s), datum)
        assert np.abs(there - flown(moved[0], pull[0], age_s)).max() < limit_m


def test_pz90_records_of_a_nominal_sky_come_back_as_wgs84():
    """Written in PZ-90, read and transformed again: where the circle is."""
    sky = nominal_glonass(START_NS)
    made = records_of("glonass", sky, Stretch(START_NS, START_NS + 7 * MINUTE_NS), wgs84=False)
    read = glonass.from_records(made, np.zeros(len(made)))
    nodes = np.array((-0.08, 0.0))
    (place, clock, _), (wanted, wanted_clock, _) = (c.sample(moments(7), nodes) for c in (read, sky))
    assert np.abs(place - wanted).max() < 0.03
    assert np.abs(clock - wanted_clock).max() < 1e-6
    assert (
        np.abs(
            records_of("glonass", sky, Stretch(START_NS, START_NS)).fields["x_km"][:24]
            - made.fields["x_km"][:24]
        ).max()
        > 3e-4
    )  # PZ-90.02 is 0.36 m away


def test_satellites_without_a_maker_of_messages_have_no_records():
    """Those of a system that has no row, and a constellation of no known kind."""
    moment = Stretch(START_NS, START_NS)
    assert records_of("galileo", nominal_gps(START_NS), moment) is None
    assert records_of("gps", object(), moment) is None
