"""What satellites report of themselves against what they reported before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.integrity.satellite_reports import TO_TELL, judged
from gnss_hil.flightsw.io.frame_statistics import Reason
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.orbit.almanac import PROVEN_NS, ROWS
from gnss_hil.flightsw.records.epoch import NO_ALMANAC, Mark, Measurements, empty_epoch
from gnss_hil.flightsw.records.solution import OrbitState
from tests.flightsw.assignment.test_boresight_angles import almanac_rows
from tests.support import synthetic_epochs as s
from tests.support.fixes import SKY, craft, in_view
from tests.support.flights import fly, soyuz, used
from tests.support.flown import CODEC, FakeBus

pytestmark = [
    pytest.mark.verifies(
        "flightsw/integrity/satellite_reports.py",
        what="Satellites that are where they were",
        by="reports of other times, 10 ms to ten minutes, of satellites on circles in an inertial frame",
        status="validated",
    ),
    pytest.mark.verifies(
        "flightsw/orbit/almanac.py",
        what="Predictions that reports are judged by",
        by="satellites on circles in an inertial frame, sought out by the light's way",
        status="validated",
    ),
]

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
FULL = raw_of("Lock")["FULL"]
SATS = [sat for _, sat in in_view(craft(), 12)]


def epoch_of(t=0.0, mark_s=None, sats=SATS, moved_m=None):
    """Reports of t under a mark that says mark_s."""
    c, n = craft(), len(sats)
    o = s.observe(c, [(0, sat) for sat in sats], SKY, t, rates=False)
    pos = np.array([o["x"], o["y"], o["z"]])
    flat, index = np.zeros(n), np.arange(n)
    m = Measurements(
        receiver=0 * index, channel=index, sat=o["sat"].astype(int), pseudorange_m=o["p"],
        range_rate_mps=flat, cn0_dbhz=flat + 45, lock=flat + FULL, health=flat, ura=flat,
        pos_sv_m=pos if moved_m is None else pos + moved_m, vel_sv_mps=np.array([o["vx"], o["vy"], o["vz"]]),
        clock_m=o["clock"], clock_drift_mps=o["drift"], signal=0 * index, frequency=flat,
    )  # fmt: skip
    mark = Mark(7, 0, s.T0_NS + round((t if mark_s is None else mark_s) * 1e9), 18)
    return replace(empty_epoch(), mark=mark, measurements=m)


def orbit(t=0.0):
    position, velocity = s.truth_ecef(craft(), t)
    return OrbitState(s.T0_NS + round(t * 1e9), position, velocity, s.T0_NS)


def predictions(sats=SATS):
    """After an epoch at 0, of which these satellites were in a fix that others agreed with."""
    e = epoch_of()
    sent_ns = e.mark.t_ns - almanac.flight_ns(e.measurements, orbit().position_m)
    table = almanac.updated(almanac.no_predictions(), NO_ALMANAC, e.measurements, e.mark.t_ns, sent_ns)
    return almanac.proven(table, np.array(sats, int), e.mark.t_ns)


def test_it_knows_when_signals_were_sent():
    """To a microsecond, in which a satellite moves 4 mm; the Earth turns meanwhile."""
    reports = judged(almanac.no_predictions(), epoch_of(), orbit())
    c = craft()
    taken_s = [s.transmission(SKY[sat], c.antenna(0, 0.0), 0.0) for sat in SATS]
    assert (s.T0_NS - reports.sent_ns) * 1e-9 == pytest.approx(taken_s, abs=1e-6)
    by_range = judged(almanac.no_predictions(), epoch_of(), None)
    clock_s = c.clock_s[0] + c.glonass_offset_s * (np.array(SATS) >= 64)
    assert (s.T0_NS - by_range.sent_ns) * 1e-9 == pytest.approx(taken_s + clock_s, abs=1e-6)


@pytest.mark.parametrize("t", [0.0, 1.0, 60.0, 299.0])
def test_satellites_that_flew_on_agree(t):
    reports = judged(predictions(), epoch_of(t), orbit(t))
    assert reports.compared.all() and reports.sound.all() and reports.agree


@pytest.mark.parametrize("of_s", [0.0, 59.0, 59.9, 60.1, 61.0, 120.0, 300.0])
def test_reports_of_another_time_do_not(of_s):
    """A satellite moves 390 m in 100 ms."""
    reports = judged(predictions(), epoch_of(of_s, mark_s=60.0), orbit(60.0))
    assert reports.moved.all() and reports.in_orbit.all() and not reports.agree


@pytest.mark.parametrize(("off_m", "moved"), [(90.0, False), (110.0, True)])
def test_new_ephemerides_are_no_contradiction(off_m, moved):
    away = np.zeros((3, len(SATS)))
    away[1, 4] = off_m
    reports = judged(predictions(), epoch_of(1.0, moved_m=away), orbit(1.0))
    assert np.flatnonzero(reports.moved).tolist() == [4] * moved and reports.agree


def test_only_what_a_fix_has_proven_contradicts():
    reports = judged(predictions(SATS[:5]), epoch_of(0.0, mark_s=60.0), orbit(60.0))
    assert reports.moved.tolist() == reports.compared.tolist() == [k < 5 for k in range(len(SATS))]
    late_s = PROVEN_NS * 1e-9
    for after_s, known in ((late_s - 1, True), (late_s + 1, False)):
        reports = judged(predictions(), epoch_of(0.0, mark_s=after_s), orbit(0.0))
        assert reports.moved.all() == reports.compared.all() == known


@pytest.mark.parametrize(
    ("known", "wrong", "agree"),
    [(TO_TELL - 1, 0, False), (TO_TELL, 0, True), (TO_TELL, 1, True), (TO_TELL, 2, False), (9, 4, True),
     (9, 5, False)],
)  # fmt: skip
def test_most_of_them_tell_if_they_are_enough(known, wrong, agree):
    away = np.zeros((3, len(SATS)))
    away[0, :wrong] = 5000.0
    assert judged(predictions(SATS[:known]), epoch_of(1.0, moved_m=away), orbit(1.0)).agree == agree


def test_what_is_in_no_orbit_is_not_sound():
    e = epoch_of()
    e.measurements.pos_sv_m[:, 2] *= 0.1
    reports = judged(almanac.no_predictions(), e, orbit())
    assert np.flatnonzero(~reports.in_orbit).tolist() == np.flatnonzero(~reports.sound).tolist() == [2]
    assert not reports.moved.any()


@pytest.mark.parametrize("sat", [0, ROWS, 511])
def test_a_number_that_no_satellite_has_is_in_no_orbit_and_never_compared(sat):
    e = epoch_of()
    e.measurements.sat[3] = sat
    reports = judged(predictions(), e, orbit())
    assert not reports.in_orbit[3] and not reports.compared[3] and reports.agree


def test_almanac_frames_that_describe_no_orbit_are_left_out():
    rows = almanac_rows(SATS[:3], SKY, 0.0)
    rows = replace(rows, vel_ecef_mps=rows.vel_ecef_mps * np.array([1.0, 5.0, 1.0]))
    reports = judged(almanac.no_predictions(), replace(epoch_of(), almanac=rows), orbit())
    assert reports.almanac.sat.tolist() == [SATS[0], SATS[2]] and reports.in_orbit.all()


def test_a_first_fix_that_nothing_checked_proves_nothing():
    """Five satellites on four antennas; the second fix agrees with the first."""
    states, *_ = fly(FakeBus(soyuz(), SKY, channels=5), configure(SOYUZ, "prototype"), 2)
    proven = [np.flatnonzero(state.predictions.proven_ns > 0).tolist() for state in states]
    assert [state.solution.fix.satellites for state in states] == [5, 5]
    assert proven[0] == [] and len(proven[1]) == 5


class MovedBus(FakeBus):
    """From epoch 5 on a channel reports another satellite's place, in an orbit as good as its own."""

    def block(self, epoch, *more, **options):
        self.late = epoch >= 5
        return super().block(epoch, *more, **options)

    def deliver(self, receiver, channel, o, k):
        if self.late and (receiver, channel) == (3, 0):
            o = {**o, "x": o["x"] - 10 * o["vx"], "y": o["y"] - 10 * o["vy"], "z": o["z"] - 10 * o["vz"]}
        return super().deliver(receiver, channel, o, k)


def test_a_channel_whose_satellite_moved_is_refused_at_the_frame_that_closes_it():
    """Frames of receiver 3 say where its first satellite was ten seconds ago."""
    states, answers, _ = fly(MovedBus(soyuz(), SKY, channels=6), configure(SOYUZ, "prototype"), 8)
    assert [state.solution.reason.name for state in states] == ["FIX"] * 8
    assert [int(state.rejected[Reason.MOVED].sum()) for state in states] == [0, 0, 0, 0, 0, 1, 2, 3]
    assert states[-1].rejected[Reason.MOVED, CODEC.can_id_of["SV_CLOCK", 3]] == 3
    assert (3, 0) not in used(answers[-1]) and (3, 1) in used(answers[-1])
