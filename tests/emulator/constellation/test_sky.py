"""The sky: nominal constellations by their definition, tables, navigation files, users' mistakes."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.constellation.base import EXACT, Broadcast
from gnss_hil.emulator.constellation.nominal import nominal_glonass, nominal_gps
from gnss_hil.emulator.constellation.sky import GRID, Sky, build_sky
from gnss_hil.emulator.constellation.sources import from_files
from gnss_hil.emulator.earth.constants import LIGHT_MPS, ROTATION_RPS
from tests.emulator.files.test_rinex_nav import GLONASS_2, GPS_2, MIXED_3

pytestmark = [
    pytest.mark.verifies(
        "emulator/constellation/nominal.py",
        what="Nominal GPS node rate",
        by=(
            "reference rate of IS-GPS-200 (-2.6e-9 semicircles/s), chosen after comparing it and the J2 rate "
            "with real skies"
        ),
        status="modelled",
    ),
    pytest.mark.verifies(
        "emulator/constellation/nominal.py",
        what="Nominal satellite clocks",
        by="small constants; no published nominal exists",
        status="modelled",
    ),
    pytest.mark.verifies(
        "emulator/constellation/sky.py",
        what="Broadcast ephemerides as the true sky",
        by="without `orbits` and factors; coordinates step where ephemerides change",
        status="modelled",
    ),
]

START = datetime(2012, 10, 31, 2, 0)
TIME = scenario.Time(start_gps=START, duration_s=600)
DAY_NS = 86_400 * gpstime.NS_PER_S


def sky_of(folder=None, time=TIME, **table):
    return build_sky(scenario.Sky(**table), time, lambda name: folder / name)


def positions(constellation, t_ns):
    return constellation.sample(np.array([t_ns]), np.zeros(1))[0][0, 0]


# --- nominal constellations ---------------------------------------------------------------------------


def test_gps_slots_at_the_epoch_of_the_standard():
    """Slot A1: right ascension of the node 272.847, argument of latitude 268.126 deg, inclination 55 deg."""
    epoch_ns = gpstime.from_utc(datetime(1993, 7, 1))
    pos = positions(nominal_gps(epoch_ns), epoch_ns)
    node, u, i = np.radians((272.847 - 15 * (18 + 36 / 60 + 14.4 / 3600), 268.126, 55.0))
    along, up = (
        np.array((np.cos(node), np.sin(node), 0)),
        np.array((-np.sin(node) * np.cos(i), np.cos(node) * np.cos(i), np.sin(i))),
    )
    expected = 26_559_700 * (np.cos(u) * along + np.sin(u) * up)
    assert pos[0] == pytest.approx(expected, abs=1e-3)
    assert np.linalg.norm(pos, axis=1) == pytest.approx(np.full(24, 26_559_700), abs=1e-6)


def test_gps_slots_of_a_plane_are_not_on_top_of_each_other():
    """The standard keeps 26 deg at least between satellites of a plane."""
    pos = positions(nominal_gps(TIME.start_ns), TIME.start_ns).reshape(6, 4, 3) / 26_559_700
    cosines = np.einsum("pik,pjk->pij", pos, pos) - 2 * np.eye(4)
    assert np.degrees(np.arccos(cosines.max())) > 26


def test_gps_ground_tracks_repeat_after_two_revolutions():
    gps = nominal_gps(TIME.start_ns)
    period_ns = round(2 * np.pi / (ROTATION_RPS + 2.6e-9 * np.pi) * 1e9)
    assert period_ns / 1e9 == pytest.approx(86155, abs=2)  # what the system is flown to, 4 min short of a day
    later = positions(gps, TIME.start_ns + period_ns)
    assert later == pytest.approx(positions(gps, TIME.start_ns), abs=1e-3)


def test_glonass_planes_slots_and_period():
    """ICD 5.1: slots 45 deg apart, planes 120 deg apart and shifted by 15 deg, 11 h 15 min 44 s."""
    glonass = nominal_glonass(TIME.start_ns)
    node = np.degrees(glonass.node_rad).reshape(3, 8)
    latitude = np.degrees(glonass.latitude_rad).reshape(3, 8)
    assert np.diff(latitude, axis=1) % 360 == pytest.approx(np.full((3, 7), 315))
    assert np.diff(latitude[:, 0]) % 360 == pytest.approx((15, 15))
    assert np.diff(node[:, 0]) % 360 == pytest.approx((120, 120))
    assert np.ptp(node, axis=1) == pytest.approx(0)
    z = [positions(glonass, TIME.start_ns + k * 40544 * gpstime.NS_PER_S)[:, 2] for k in (0, 1)]
    assert z[1] == pytest.approx(z[0], abs=1e-3)
    assert np.linalg.norm(positions(glonass, 0), axis=1) == pytest.approx(np.full(24, 25_508_000), abs=2000)


def test_glonass_frequencies_are_shared_by_antipodal_slots_only():
    frequency = nominal_glonass(TIME.start_ns).frequency.reshape(3, 8)
    assert np.array_equal(frequency[:, :4], frequency[:, 4:])
    assert len(np.unique(frequency)) == 12
    assert frequency.min() == -7 and frequency.max() == 6


def test_nominal_clocks_differ_and_fit_the_bus():
    state = sky_of().at(TIME.start_ns)
    assert len(np.unique(state.clock_m)) == 48
    assert np.abs(state.clock_m).max() < 30_000
    assert np.abs(state.clock_drift_mps).max() < 2e-3
    assert state.broadcast.available.all() and state.broadcast.healthy.all()


# --- the table ----------------------------------------------------------------------------------------


@pytest.mark.verifies(
    "emulator/constellation/sky.py",
    "emulator/constellation/base.py",
    "emulator/numerics/chebyshev.py",
    what="Sky as a table, switches of ephemerides",
    by="direct evaluation, 3e-8 m",
    status="modelled",
)
def test_the_table_gives_what_the_constellations_give():
    """Within 10 um and 1 um of clock, anywhere in a day, in any order."""
    sky, parts = sky_of(), (nominal_gps(TIME.start_ns), nominal_glonass(TIME.start_ns))
    for t_ns in np.random.default_rng(3).integers(TIME.start_ns, TIME.start_ns + DAY_NS, 40).tolist():
        state = sky.at(t_ns)
        assert state.pos_ecef_m == pytest.approx(
            np.concatenate([positions(p, t_ns) for p in parts]), abs=1e-5
        )
        clocks = np.concatenate([p.sample(np.array([t_ns]), np.zeros(1))[1][0, 0] for p in parts])
        assert state.clock_m == pytest.approx(clocks, abs=1e-6)


def test_derivatives():
    sky, step_ns = sky_of(), 250_000_000
    for t_ns in (TIME.start_ns, TIME.start_ns + 59_900_000_000, TIME.start_ns + 4000 * gpstime.NS_PER_S):
        before, now, after = (sky.at(t_ns + k * step_ns) for k in (-1, 0, 1))
        assert (after.pos_ecef_m - before.pos_ecef_m) / 0.5 == pytest.approx(now.vel_ecef_mps, abs=1e-5)
        assert (after.vel_ecef_mps - before.vel_ecef_mps) / 0.5 == pytest.approx(now.acc_ecef_mps2, abs=1e-7)
        assert (after.clock_m - before.clock_m) / 0.5 == pytest.approx(now.clock_drift_mps, abs=1e-6)


def test_the_glonass_offset_is_in_what_is_transmitted_and_in_no_message():
    plain, shifted = (
        sky_of(glonass_offset_ns=0).at(TIME.start_ns),
        sky_of(glonass_offset_ns=30).at(TIME.start_ns),
    )
    glonass = satellites.system_of(shifted.index) == satellites.GLONASS
    assert np.array_equal(plain.clock_m, shifted.clock_m)
    assert np.array_equal(plain.clock_truth_m, plain.clock_m)
    assert (shifted.clock_m - shifted.clock_truth_m)[glonass] == pytest.approx(np.full(24, 30e-9 * LIGHT_MPS))
    assert not (shifted.clock_m - shifted.clock_truth_m)[~glonass].any()


def test_any_order_of_questions_gives_the_same_sky():
    times = [TIME.start_ns + k * 601 * gpstime.NS_PER_S for k in range(-3, 20)]
    one, other = sky_of(), sky_of()
    forward = [one.at(t).pos_ecef_m.tobytes() for t in times]
    assert forward == [other.at(t).pos_ecef_m.tobytes() for t in reversed(times)][::-1]


def test_one_system_alone():
    assert len(sky_of(glonass="none").at(TIME.start_ns).index) == 24
    assert set(satellites.system_of(sky_of(gps="none").index)) == {satellites.GLONASS}


# --- skies from files ---------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    for name, text in (("gps.n", GPS_2), ("glonass.g", GLONASS_2), ("mixed.rnx", MIXED_3)):
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_mixed_sky_switches_ephemerides_on_whole_minutes(folder):
    sky = sky_of(folder, gps="gps.n")
    row = int(np.flatnonzero(sky.index == satellites.index(satellites.GPS, 7))[0])
    end_ns = gpstime.from_calendar(datetime(2012, 10, 31, 4))
    minute_ns = 60 * gpstime.NS_PER_S
    state = sky.at(TIME.start_ns)
    assert len(state.index) == 25
    broadcast = state.broadcast
    assert broadcast.available.all() and broadcast.iod[row] == 16 and broadcast.ura[row] == EXACT
    times_ns = [end_ns + k * minute_ns + d for k in (-1, 0, 1) for d in (-1, 0)]
    known = [bool(sky.at(t_ns).broadcast.available[row]) for t_ns in times_ns]
    assert known == [True, True, True, True, True, False]  # valid to 04:00:00, and the minute begun then


def test_files_of_both_systems_and_one_mixed_file_make_the_same_sky(folder):
    time = scenario.Time(start_gps=datetime(2012, 10, 31, 0, 20), duration_s=60)
    two = sky_of(folder, time, gps=["gps.n"], glonass="glonass.g").at(time.start_ns)
    one = sky_of(folder, time, gps="mixed.rnx", glonass="mixed.rnx").at(time.start_ns)
    assert [satellites.name(i) for i in two.index] == ["G07", "R03"]
    assert two.pos_ecef_m == pytest.approx(one.pos_ecef_m, abs=1e-6)
    # Each file has its own tau_c.
    assert one.clock_m - two.clock_m == pytest.approx((0, LIGHT_MPS * (-1.8626451492e-9 - 1.597218215466e-7)))


MISTAKES = [
    ({"gps": "none", "glonass": "none"}, "sky: gps and glonass are both 'none'"),
    ({"gps": []}, "sky.gps: no navigation file is named"),
    ({"gps": "absent.n"}, "absent.n: No such file or directory"),
    ({"gps": "glonass.g"}, "glonass.g: no GPS record"),
    ({"glonass": ["gps.n", "gps.n"]}, "no GLONASS record"),
    (
        {"glonass": "glonass.g"},
        "from 2012-10-31T00:00:16 to 2012-10-31T00:30:16; the run is from 2012-10-31T02:00:00",
    ),
]


@pytest.mark.parametrize(("table", "expected"), MISTAKES)
def test_a_sky_that_cannot_be_had_is_refused_in_one_line(folder, table, expected):
    with pytest.raises(scenario.ScenarioError) as caught:
        sky_of(folder, **table)
    message = str(caught.value)
    assert message.startswith("sky")
    assert expected in message
    assert "\n" not in message


_UNFIT = "0.200000000000D+01 0.100000000000D+01"
_NO_PREDICTION = "-.100000000000D+01 0.000000000000D+00"


@pytest.mark.parametrize(
    ("old", "new", "more", "said"),
    [
        ("", "", False, []),
        (
            "0.200000000000D+01 0.000000000000D+00",
            _UNFIT,
            False,
            ["all satellites known are marked unhealthy"],
        ),
        (
            "0.229351786584D+01",
            "0.239351786584D+01",
            True,
            ["different messages of one time of G07: the last"],
        ),
        (
            "0.280183739960D-03",
            "0.999999999999D+09",
            True,
            ["1 record of GPS is left out: their places or"],
        ),
    ],
)
def test_what_is_odd_about_messages_is_told(folder, old, new, more, said):
    record = GPS_2.split("END OF HEADER\n")[1]
    assert old in record
    changed = GPS_2.replace(old, new) if old else GPS_2
    (folder / "odd.n").write_text(changed + (record if more else ""))
    told = []
    sky = scenario.Sky(gps="odd.n", glonass="none")
    assert build_sky(sky, TIME, lambda name: folder / name, tell=told.append)
    assert [remark.startswith("sky.gps: ") for remark in told] == [True] * len(said)
    assert all(words in remark for words, remark in zip(said, told, strict=True))


def test_an_accuracy_below_nothing_is_no_prediction(folder):
    (folder / "odd.n").write_text(GPS_2.replace("0.200000000000D+01 0.000000000000D+00", _NO_PREDICTION))
    made = from_files("gps", [folder / "odd.n"], TIME)
    assert made.sample(np.array([TIME.start_ns]), np.zeros(1))[2].ura.tolist() == [[15]]


def test_the_last_epoch_has_to_be_covered_too(folder):
    time = scenario.Time(start_gps=datetime(2012, 10, 31, 3, 50), duration_s=601)
    assert sky_of(folder, time, gps="gps.n", glonass="none")
    longer = scenario.Time(start_gps=datetime(2012, 10, 31, 3, 50), duration_s=602)
    with pytest.raises(scenario.ScenarioError, match="to 2012-10-31T04:00:01 "):
        sky_of(folder, longer, gps="gps.n", glonass="none")


def test_segments_are_whole_minutes_of_gps_time():
    assert GRID.origin_ns == 0 and GRID.segment_ns == 60 * gpstime.NS_PER_S
    assert isinstance(sky_of(), Sky)


# --- a truth that is not what satellites broadcast ------------------------------------------------------


class Delayed:
    """GPS satellites whose messages have group delays, and who never move."""

    index = satellites.index(satellites.GPS, np.array((3, 9)))
    delay_m = np.array((-3.0, 4.5))

    def sample(self, middles_ns, nodes_s):
        s, k, n = len(middles_ns), len(nodes_s), 2
        positions = np.broadcast_to(np.array((2.6e7, 0.0, 0.0)), (s, k, n, 3))
        yes, zeros = np.ones((s, n), bool), np.zeros((s, n), np.int64)
        # IS-GPS-200, 20.3.3.3.3.2: the clock of a user of L1 alone is that of two frequencies less T_GD.
        clocks = np.broadcast_to(-self.delay_m, (s, k, n))
        delay_m = np.broadcast_to(self.delay_m, (s, n))
        broadcast = Broadcast(yes, yes, zeros, zeros, zeros, zeros, delay_m, np.zeros((s, n)))
        return positions, clocks, broadcast


class Flown:
    """The same satellites by a precise product: clocks of two frequencies, all zero."""

    index = Delayed.index

    def sample(self, middles_ns, nodes_s):
        positions, clocks, broadcast = Delayed().sample(middles_ns, nodes_s)
        return positions, np.zeros(clocks.shape), broadcast.available


def test_precise_clocks_transmit_l1_with_the_group_delay():
    """A perfect message and the truth are then the same clock: a user of L1 has no error."""
    state = Sky([Delayed()], [0.0], Flown()).at(TIME.start_ns)
    assert state.clock_truth_m == pytest.approx(-Delayed.delay_m, abs=1e-6)
    assert state.clock_m == pytest.approx(state.clock_truth_m, abs=1e-6)


class Apart(Delayed):
    """The same with GLONASS satellites, whose carriers leave apart; the clocks of messages are L1's."""

    index = satellites.index(satellites.GLONASS, np.array((3, 9)))
    apart_m = np.array((2.0, -3.0))
    share = 7**2 / (9**2 - 7**2)
    """f2^2 / (f1^2 - f2^2): of ranges without ionosphere, (f1^2 P1 - f2^2 P2) / (f1^2 - f2^2)."""

    def sample(self, middles_ns, nodes_s):
        positions, clocks, broadcast = super().sample(middles_ns, nodes_s)
        zeros = np.zeros(broadcast.iod.shape)
        told = replace(broadcast, group_delay_m=zeros, band_delay_m=zeros + self.apart_m)
        return positions, np.broadcast_to(-self.share * self.apart_m, clocks.shape), told


def test_precise_clocks_transmit_l1_of_glonass_with_the_delay_of_l2():
    flown = SimpleNamespace(index=Apart.index, sample=Flown().sample)
    state = Sky([Apart()], [0.0], flown).at(TIME.start_ns)
    assert state.clock_truth_m == pytest.approx(-49 / 32 * Apart.apart_m, abs=1e-6)
    assert state.clock_m == pytest.approx(state.clock_truth_m, abs=1e-6)


def test_the_clock_of_a_glonass_file_is_against_gps_time(tmp_path):
    """GLONASS ICD 5.1, 3.3.3: UTC(SU) + 3 h = t + tau_c + tau_n at tb: a file writes both with a minus."""
    (tmp_path / "day.g").write_text(GLONASS_2)
    moment = datetime(2012, 10, 31, 0, 15, 16)
    time = scenario.Time(start_gps=moment, duration_s=60)
    state = sky_of(tmp_path, time, gps="none", glonass="day.g", glonass_offset_ns=0).at(time.start_ns)
    clock_m = state.clock_m[state.index == satellites.parse("R03")]
    assert clock_m == pytest.approx(LIGHT_MPS * (-1.236097887158e-4 + 1.597218215466e-7), abs=1e-6)
