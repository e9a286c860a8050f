"""Broadcast ephemerides: orbits against independent integration, clocks by hand, which one holds when."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.constellation.broadcast import glonass, gps
from gnss_hil.emulator.constellation.broadcast.ephemerides import latest_of_each, nearest_valid
from gnss_hil.emulator.earth.constants import LIGHT_MPS, ROTATION_RPS
from gnss_hil.emulator.files.rinex_layouts import GLONASS_FIELDS, GPS_FIELDS
from gnss_hil.emulator.files.rinex_nav import Records

pytestmark = pytest.mark.verifies(
    "emulator/constellation/broadcast/glonass.py",
    what="GLONASS accuracy index",
    by="always 3; records before RINEX 3.05 carry none",
    status="modelled",
)

C = LIGHT_MPS
S = gpstime.NS_PER_S
TOE = datetime(2012, 10, 31, 2)
GPS_PLAIN = dict.fromkeys(GPS_FIELDS, 0.0) | {
    "sqrt_a": 5153.7, "e": 0.012, "i0": 0.96, "omega0": 2.3, "omega": 0.5, "m0": -0.7,
    "ura_m": 2.8, "iode": 77.0, "toe": 3 * 86400 + 7200.0, "transmission": 3 * 86400.0, "fit_h": 4.0,
}  # fmt: skip
GLONASS_PLAIN = dict.fromkeys(GLONASS_FIELDS, 0.0) | {
    "x_km": -23809.82, "y_km": -8908.935, "z_km": 2209.434,
    "vx_kmps": 0.22894573, "vy_kmps": 0.25361347, "vz_kmps": 3.55604934, "frequency": 5.0,
}  # fmt: skip


def records(plain, *rows):
    """Records from (number, epoch, changed fields)."""
    full = [plain | changes for _, _, changes in rows]
    fields = {name: np.array([row[name] for row in full]) for name in plain}
    return Records(np.array([n for n, _, _ in rows]), tuple(epoch for _, epoch, _ in rows), fields)


def gps_of(*rows):
    return gps.from_records(records(GPS_PLAIN, *rows))


def glonass_of(*rows, minus_tau_c_s=0.0):
    return glonass.from_records(records(GLONASS_PLAIN, *rows), np.full(len(rows), minus_tau_c_s))


def at(constellation, moment, seconds=0.0):
    """Positions (n, 3), clocks (n,) and what is broadcast (each (n,)) at a GPS calendar instant."""
    middle = np.array([gpstime.from_calendar(moment)])
    pos, clock, broadcast = constellation.sample(middle, np.array([seconds]))
    return pos[0, 0], clock[0, 0], {name: getattr(broadcast, name)[0] for name in broadcast.__slots__}


def test_the_delay_of_glonass_l2_is_broadcast_beside_the_clock():
    """ICD 5.1, 4.4: Delta tau_n = t_f2 - t_f1; the clock stays that of L1."""
    plain, moment = glonass_of((3, datetime(2012, 10, 31, 0, 15), {})), datetime(2012, 10, 31, 0, 15, 16)
    late = replace(plain, band_delay_s=np.array([4e-9]))
    (_, clock, told), (_, same, said) = (at(c, moment) for c in (plain, late))
    assert told["band_delay_m"].tolist() == [0] and clock == same
    assert said["band_delay_m"] == pytest.approx([4e-9 * C])


# --- GPS ----------------------------------------------------------------------------------------------


def test_gps_orbit_without_corrections_is_two_body_motion_under_a_turning_earth():
    """Elements to a state by another route (perifocal), then DOP853, then the Earth turned under it."""
    sat = gps_of((7, TOE, {}))
    a, e = GPS_PLAIN["sqrt_a"] ** 2, GPS_PLAIN["e"]
    p_from_q = rotation(GPS_PLAIN["omega0"] - ROTATION_RPS * GPS_PLAIN["toe"], "z") @ (
        rotation(GPS_PLAIN["i0"], "x") @ rotation(GPS_PLAIN["omega"], "z")
    )
    anomaly = GPS_PLAIN["m0"]
    for _ in range(60):
        anomaly = GPS_PLAIN["m0"] + e * np.sin(anomaly)
    n = np.sqrt(3.986005e14 / a**3)
    rate = n / (1 - e * np.cos(anomaly))
    b = a * np.sqrt(1 - e * e)
    pos = p_from_q @ (a * (np.cos(anomaly) - e), b * np.sin(anomaly), 0)
    vel = p_from_q @ (-a * np.sin(anomaly) * rate, b * np.cos(anomaly) * rate, 0)
    for age_s in (-7000, 900, 7200):
        solution = solve_ivp(
            lambda _, y: np.concatenate((y[3:], -3.986005e14 * y[:3] / np.linalg.norm(y[:3]) ** 3)),
            (0, age_s), np.concatenate((pos, vel)), method="DOP853", rtol=1e-13, atol=1e-6,
        )  # fmt: skip
        expected = rotation(-ROTATION_RPS * age_s, "z") @ solution.y[:3, -1]
        assert at(sat, TOE + timedelta(seconds=age_s))[0][0] == pytest.approx(expected, abs=1e-4)


def rotation(angle, axis):
    """Active rotation matrix about z or x."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array(((c, -s, 0), (s, c, 0), (0, 0, 1)) if axis == "z" else ((1, 0, 0), (0, c, -s), (0, s, c)))


def test_gps_harmonic_corrections_act_along_track_radially_and_across():
    """At argument of latitude phi: cuc cos 2 phi along, crc ... up, cic ... across (table 20-IV)."""
    plain, _, _ = at(gps_of((7, TOE, {})), TOE)
    vel = (at(gps_of((7, TOE, {})), TOE, 0.5)[0] - at(gps_of((7, TOE, {})), TOE, -0.5)[0])[0]
    vel += np.cross((0, 0, ROTATION_RPS), plain[0])
    r = np.linalg.norm(plain[0])
    up = plain[0] / r
    normal = np.cross(plain[0], vel)
    normal /= np.linalg.norm(normal)
    along = np.cross(normal, up)
    e, m = GPS_PLAIN["e"], GPS_PLAIN["m0"]
    anomaly = m + e * np.sin(m + e * np.sin(m + e * np.sin(m)))
    phi = 2 * np.arctan(np.sqrt((1 + e) / (1 - e)) * np.tan(anomaly / 2)) + GPS_PLAIN["omega"]
    for name, size, direction, lever in (
        ("cuc", 1e-6, along, r), ("crc", 200.0, up, 1), ("cic", 1e-7, normal * np.sin(phi), r),
    ):  # fmt: skip
        moved = (at(gps_of((7, TOE, {name: size})), TOE)[0] - plain)[0]
        assert moved == pytest.approx(size * lever * np.cos(2 * phi) * direction, abs=2e-3), name


def test_gps_clock_by_hand():
    """Polynomial from toc, relativity, less TGD; the record's epoch is toc."""
    changes = {"af0": 2e-4, "af1": -3e-12, "af2": 1e-17, "tgd": -1.1e-8, "e": 0.0, "delta_n": 0.0}
    _, clock, _ = at(gps_of((7, TOE, changes)), TOE + timedelta(seconds=600))
    assert clock[0] == pytest.approx(C * (2e-4 - 3e-12 * 600 + 1e-17 * 600**2 + 1.1e-8), abs=1e-6)


def test_gps_relativity_is_minus_two_r_dot_v_over_c_squared():
    """IS-GPS-200, 20.3.3.3.3.1 gives both forms; r.v is the same in turning axes."""
    sat = gps_of((7, TOE, {}))
    (pos, clock, _), (before, _, _), (after, _, _) = (at(sat, TOE, s) for s in (0.0, -0.5, 0.5))
    assert clock[0] == pytest.approx(-2 * pos[0] @ (after - before)[0] / C, abs=1e-4)
    assert abs(clock[0]) > 1


def test_gps_broadcast_words():
    rows = [
        (n, TOE, {"health": h, "ura_m": u})
        for n, h, u in ((1, 0, 2.0), (2, 63, 2.8), (3, 0, 11.3), (4, 0, 9e3))
    ]
    _, _, broadcast = at(gps_of(*rows), TOE)
    assert broadcast["healthy"].tolist() == [True, False, True, True]
    assert broadcast["ura"].tolist() == [0, 1, 5, 15]
    assert broadcast["iod"].tolist() == [77] * 4
    assert broadcast["frequency"].tolist() == [0] * 4


@pytest.mark.parametrize(("written", "half_h"), [(0, 2), (4, 2), (1, 3), (6, 3), (8, 4), (999, 2)])
def test_gps_fit_interval(written, half_h):
    sat = gps_of((7, TOE, {"fit_h": written}))
    edge = timedelta(hours=half_h)
    minute = timedelta(seconds=30)  # middles of minutes that the interval's ends lie in
    ages = (-edge - 2 * minute, -edge - minute, edge + minute, edge + 2 * minute)
    assert [bool(at(sat, TOE + age)[2]["available"][0]) for age in ages] == [False, True, True, False]
    assert sat.span_ns == tuple(gpstime.from_calendar(TOE + sign * edge) for sign in (-1, 1))


def test_gps_ephemeris_across_the_end_of_a_week():
    """toe 0 of the new week with a clock epoch in the old one, and the other way round."""
    sunday = datetime(2012, 11, 4)
    for toc, toe, moment in (
        (sunday - timedelta(seconds=16), 0.0, sunday),
        (sunday, 604784.0, sunday - timedelta(seconds=16)),
    ):
        sat = gps_of((7, toc, {"toe": toe}))
        assert sat.toe_ns[0] == gpstime.from_calendar(moment)


# --- GLONASS ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("age_s", [-900, 437, 900])
def test_glonass_integration_agrees_with_dop853_in_inertial_space(age_s):
    """The ICD's equations turn with the Earth; here the same forces act in inertial axes."""
    mu, re, j2, w = 398_600.4418e9, 6_378_136.0, 1_082_625.75e-9, 7.292115e-5
    state = np.array(
        [GLONASS_PLAIN[f"{p}{axis}_km{s}"] * 1e3 for p, s in (("", ""), ("v", "ps")) for axis in "xyz"]
    )
    pos, vel = state[:3], state[3:] + np.cross((0, 0, w), state[:3])
    luni_solar = np.array((-3.7e-6, 0.9e-6, -1.9e-6))

    def rate(t, y):
        r, d = y[:3], np.linalg.norm(y[:3])
        s2 = (r[2] / d) ** 2
        j2_pull = -1.5 * j2 * mu * re**2 / d**5 * r * (1 - 5 * s2 + np.array((0, 0, 2)))
        return np.concatenate((y[3:], -mu * r / d**3 + j2_pull + rotation(w * t, "z") @ luni_solar))

    solution = solve_ivp(rate, (0, age_s), np.concatenate((pos, vel)), method="DOP853", rtol=1e-13, atol=1e-6)
    expected = rotation(-w * age_s, "z") @ solution.y[:3, -1]
    assert glonass.propagate(state, luni_solar, np.array(float(age_s)))[:3] == pytest.approx(
        expected, abs=1e-5
    )


def test_glonass_epochs_are_utc_and_the_state_holds_at_tb():
    """16 leap seconds in 2012; PZ-90.02 to WGS-84 shifts by (-0.36, +0.08, +0.18) m (ICD 5.1, 3.3.4)."""
    pos, _, broadcast = at(glonass_of((3, TOE, {})), TOE + timedelta(seconds=16))
    expected = [
        1e3 * GLONASS_PLAIN[f"{axis}_km"] + s for axis, s in zip("xyz", (-0.36, 0.08, 0.18), strict=True)
    ]
    assert pos[0] == pytest.approx(expected, abs=1e-6)
    assert broadcast["available"][0]
    assert broadcast["iod"][0] == (2 + 3) * 4  # quarters of an hour of the Moscow day
    assert broadcast["frequency"][0] == 5


@pytest.mark.parametrize(
    ("day", "shift"),
    [
        (datetime(2007, 9, 19, 12), (-1.43 + 25e6 * -0.22e-6, 0.05 + 25e6 * np.radians(0.13 / 3600), 0.20)),
        (datetime(2007, 9, 20, 12), (-0.36, 0.08, 0.18)),
        (datetime(2013, 12, 30, 12), (-0.36, 0.08, 0.18)),
        (datetime(2014, 1, 1, 12), (-0.003, -0.001, 25e6 * np.radians(-0.042e-3 / 3600))),
    ],
)
def test_glonass_datum_by_date(day, shift):
    """A satellite on the x axis: PZ-90 of before 2007 is turned by -0.13" about z and 0.22 ppm large."""
    datum = glonass_of((3, day, {})).datum
    moved = glonass.to_wgs84(np.array((25e6, 0.0, 0.0)), datum[0])
    assert moved - (25e6, 0, 0) == pytest.approx(shift, abs=2e-3)


def test_glonass_clock_by_hand():
    """-TauN + GammaN (t - tb) - tau_c; a message older by 5 min drifts on."""
    changes = {"minus_tau": -1.2e-4, "gamma": 3e-12}
    sat = glonass_of((3, TOE, changes), minus_tau_c_s=1.6e-7)
    _, clock, _ = at(sat, TOE + timedelta(seconds=16 + 300))
    assert clock[0] == pytest.approx(C * (-1.2e-4 + 1.6e-7 + 3e-12 * 300), abs=1e-6)


def test_glonass_serves_a_quarter_of_an_hour_to_the_end_of_the_begun_minute():
    sat = glonass_of((3, TOE, {"health": 0}), (4, TOE, {"health": 1}))
    start = TOE + timedelta(seconds=16)
    ages = [timedelta(seconds=s) for s in (-931, -930, 930, 931)]
    assert [at(sat, start + age)[2]["available"].tolist() for age in ages] == [
        [False, False], [True, True], [True, True], [False, False],
    ]  # fmt: skip
    assert at(sat, start)[2]["healthy"].tolist() == [True, False]
    far, clock, _ = at(sat, start + timedelta(days=3))
    assert np.isfinite(far).all() and np.isfinite(clock).all()


# --- selection ----------------------------------------------------------------------------------------


def test_the_nearest_valid_ephemeris_holds_and_of_two_equal_ones_the_later():
    number, reference = np.array([1, 1, 1, 2]), np.array([0, 100, 200, 50])
    moments = np.array([-30, 49, 50, 51, 149, 150, 260, 400])
    reference, moments = reference * 10**9, moments * 10**9
    valid = np.array([30, 30, 30, 970]) * 10**9
    rows, valid = nearest_valid(number, reference, valid, np.array([1, 2]), moments)
    assert rows[:, 0].tolist() == [0, 0, 1, 1, 1, 2, 2, 2]
    assert valid[:, 0].tolist() == [True] * 7 + [False]
    assert rows[:, 1].tolist() == [3] * 8
    assert valid[:, 1].all()


def test_a_valid_ephemeris_goes_before_a_nearer_one_that_is_not():
    rows, valid = nearest_valid(
        np.array([1, 1]), np.array([0, 200]) * S, np.array([150, 10]) * S, np.array([1]), np.array([150 * S])
    )
    assert rows.tolist() == [[0]] and valid.tolist() == [[True]]


def test_of_ephemerides_for_the_same_instant_the_last_upload_is_kept():
    number, reference = np.array([5, 3, 3, 3, 5]), np.array([10, 20, 10, 10, 10])
    kept = latest_of_each(number, reference, np.array([0.0, 1.0, 9.0, 4.0, 0.0]))
    assert kept.tolist() == [2, 1, 4]  # 3 at 10 (upload 9), 3 at 20, 5 at 10 (the last read)


def test_upload_order_runs_on_across_the_end_of_a_week():
    sunday = datetime(2012, 11, 4)
    sat = gps_of(
        (7, sunday, {"toe": 0.0, "transmission": 604_000.0, "iode": 1.0}),
        (7, sunday, {"toe": 0.0, "transmission": 30.0, "iode": 2.0}),
    )
    assert sat.fields["iode"].tolist() == [2.0]


def test_a_record_whose_upload_is_unknown_gives_way_to_one_whose_is_known():
    rows = [(7, TOE, {"transmission": sent, "iode": k}) for k, sent in enumerate((np.nan, 1.0, np.nan))]
    for order in ((0, 1), (1, 2), (1, 0, 2)):
        assert gps_of(*(rows[k] for k in order)).fields["iode"].tolist() == [1]
    assert gps_of(rows[0], rows[2]).fields["iode"].tolist() == [2]
