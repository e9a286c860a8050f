"""Errors of broadcast clocks: Allan deviations by an independent library, growth since the upload."""

from __future__ import annotations

import allantools
import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.constellation.sky import GRID
from gnss_hil.emulator.constellation.uploads import MINUTE_NS, uploads
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models import satellite_clock_error
from gnss_hil.emulator.error_models.satellite_clock_error import SatelliteClockError
from tests.emulator.error_models.test_ephemeris_error import BOTH, GPS, START_NS, middles

FORTNIGHT = SatelliteClockError(gps_upload_s=14 * 86400)


def off_m(parameters, index, middles_ns, nodes_s, seed=1):
    return satellite_clock_error.errors(parameters, seed, index, middles_ns, nodes_s)


def free_for_days(days):
    """Minutes (m,) after START_NS in which satellites keep one upload for some days, and which ones do."""
    plan = uploads(1, GPS, {satellites.GPS: 14 * 86400})
    first = START_NS // MINUTE_NS
    before, after = plan.number(np.array((first, first + days * 1440)))
    return GPS[before == after]


@pytest.mark.verifies(
    "emulator/error_models/satellite_clock_error.py",
    what="Errors of broadcast clocks: wandering since the upload",
    by=(
        "Allan deviation by allantools, 5 %: that of the kind of clock over a day, and the law of white "
        "noise of frequency below; growth since the upload by Allan's prediction errors. Straight within a "
        "minute"
    ),
    status="validated",
)
@pytest.mark.parametrize(("kind", "day"), [("rb", 1e-14), ("cs", 1e-13)])
def test_allan_deviation_over_a_day_is_the_clocks(kind, day):
    """Rubidium of GPS IIF 1e-14, caesium of GLONASS-M 1e-13 over a day; before that the square-root law of
    white noise of frequency. Overlapping Allan deviation by allantools."""
    index = free_for_days(7)
    assert len(index) > 8
    parameters = SatelliteClockError(gps_clock=kind, gps_upload_s=14 * 86400)
    seconds = off_m(parameters, index, middles(7 * 1440), np.array((-30.0,)))[:, 0].T / LIGHT_MPS
    taus = np.array((60.0, 600.0, 3600.0, 21600.0, 86400.0))
    variances = []
    for clock in seconds:
        found, deviation, _, _ = allantools.oadev(clock, rate=1 / 60, data_type="phase", taus=taus)
        assert found == pytest.approx(taus)
        variances.append(deviation**2)
    deviation = np.sqrt(np.mean(variances, axis=0))
    assert deviation[:3] == pytest.approx(day * np.sqrt(86400 / taus[:3]), rel=0.05)
    assert deviation[3:] == pytest.approx(day * np.sqrt(86400 / taus[3:]), rel=0.3)


@pytest.mark.slow
@pytest.mark.verifies(what="Errors of broadcast clocks: wandering since the upload")
def test_the_error_grows_from_its_upload():
    """Variance: of the offset, and twice tau^2 sigma_y(tau)^2 at a day (free run, frequency of a day)."""
    parameters = SatelliteClockError()
    plan = uploads(1, GPS, {satellites.GPS: 86400})
    samples = {0: [], 1439: []}
    for age, found in samples.items():
        for day in range(1, 120):
            number = plan.number(np.array([START_NS // MINUTE_NS + 1440 * day]))
            minutes, which = np.unique(plan.begun(number)[0] + age, return_inverse=True)
            node = np.array((-30.0,)) if age == 0 else np.array((30.0,))
            off = off_m(parameters, GPS, minutes * MINUTE_NS + MINUTE_NS // 2, node)[:, 0]
            found.append(off[which, np.arange(len(GPS))])
    begun, ended = (np.concatenate(found) for found in samples.values())
    assert begun.std() == pytest.approx(0.6, rel=0.05)
    assert (ended - begun).std() == pytest.approx(LIGHT_MPS * 86400 * 1e-14 * np.sqrt(2), rel=0.05)


def test_clocks_run_on_from_minute_to_minute():
    off = off_m(FORTNIGHT, free_for_days(1), middles(1440), np.array((-30.0, 0.0, 30.0)))
    assert off[1:, 0] == pytest.approx(off[:-1, 2], abs=1e-9)
    assert off[:, 1] == pytest.approx((off[:, 0] + off[:, 2]) / 2, abs=1e-12)


def test_values_do_not_depend_on_what_else_is_asked():
    middles_ns = middles(60)
    every = off_m(SatelliteClockError(), BOTH, middles_ns, GRID.nodes_s)
    rows = np.array((50, 2))
    assert off_m(SatelliteClockError(), BOTH[rows], middles_ns[31:33], GRID.nodes_s) == pytest.approx(
        every[31:33][:, :, rows], abs=1e-9
    )
    assert np.abs(every - off_m(SatelliteClockError(), BOTH, middles_ns, GRID.nodes_s, seed=2)).min() > 0


def test_other_systems_report_the_truth():
    galileo = satellites.index(SYSTEMS["galileo"].value, np.array((4, 9)))
    assert not off_m(SatelliteClockError(), galileo, middles(3), GRID.nodes_s).any()
