"""The flight software on what a real spaceborne receiver measured: GRACE-B, 27 July 2010.

Made ready here without the emulator: CODE orbits by SciPy's barycentric interpolation, clocks linearly, and
nothing else; satellites' antenna offsets and GRACE's own (0.6 m above its centre of mass) are left out. The
judge is the published orbit (CODE, Bernese).
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.emulator.files import rinex_obs, sp3
from gnss_hil.flightsw.estimation.position import solve
from gnss_hil.flightsw.estimation.propagate_to_mark import propagated_to_mark
from gnss_hil.flightsw.integrity.exclusion import STRICT, Rules
from gnss_hil.flightsw.measurement.ionosphere_free import ionosphere_free
from gnss_hil.flightsw.measurement.observables import of_one_signal
from gnss_hil.flightsw.records.epoch import Measurements
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import Fix
from tests.support.budgets import budget
from tests.support.outside import data_file

pytestmark = pytest.mark.realdata
FOLDER = "grace_b_2010-07-27"
LIGHT_MPS, EARTH_RPS = 299_792_458.0, np.array([0.0, 0.0, 7.2921151467e-5])
SIGNAL = {label: raw for raw, label in VALUES["Signal"].items()}
EVERY = 30
"""One epoch in thirty: five minutes apart."""


@dataclass(frozen=True, slots=True)
class Epoch:
    """What the receiver measured at a tag, and where it was then: published position and velocity (3,)."""

    measured: Measurements
    position_m: np.ndarray
    velocity_mps: np.ndarray


@dataclass(frozen=True, slots=True)
class Sky:
    """A product on its grid: seconds (t,), columns by satellite index, positions (t, n, 3), clocks (t, n)."""

    seconds: np.ndarray
    column: dict[int, int]
    pos_ecef_m: np.ndarray
    clock_s: np.ndarray

    def report(self, sat: int, t_s: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Position, velocity and clock with its relativity, at an instant of GPS time."""
        k = int(np.searchsorted(self.seconds, t_s))
        around, column = slice(k - 5, k + 6), self.column[sat]
        path = BarycentricInterpolator((self.seconds[around] - t_s) / 900, self.pos_ecef_m[around, column])
        pos, vel = path(0.0), (path(1 / 900) - path(-1 / 900)) / 2
        clock = np.interp(t_s, self.seconds[k - 1 : k + 1], self.clock_s[k - 1 : k + 1, column])
        return pos, vel, clock - 2 * (pos @ (vel + np.cross(EARTH_RPS, pos))) / LIGHT_MPS**2


def published() -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """GPS time [ns] -> position [m], velocity [m/s]; the file has km and dm/s."""
    orbit = {}
    with gzip.open(data_file(f"{FOLDER}/grcb_truth.csv.gz"), "rt") as lines:
        for line in lines:
            date, time, *numbers = line.strip().split(",")
            t_ns = gpstime.from_calendar(datetime.strptime(f"{date} {time}", "%d/%m/%Y %H:%M:%S"))
            values = np.array(numbers, float)
            orbit[t_ns] = values[:3] * 1e3, values[3:] * 0.1
    return orbit


@pytest.fixture(scope="module")
def day() -> list[Epoch]:
    heard = rinex_obs.read(data_file(f"{FOLDER}/GRCB2080.10D.gz"))
    product = sp3.joined([sp3.read(data_file(f"{FOLDER}/COD1594{k}.EPH.gz")) for k in (1, 2, 3)])
    origin_ns = heard.t_ns[0]
    sky = Sky(
        (product.t_ns - origin_ns) * 1e-9,
        {int(name[1:]): k for k, name in enumerate(product.name) if name[0] == "G"},
        product.pos_ecef_m,
        product.clock_s,
    )
    orbit = published()
    return [
        Epoch(measured(heard, epoch, sky, (t_ns - origin_ns) * 1e-9), *orbit[t_ns])
        for epoch, t_ns in enumerate(heard.t_ns.tolist())
        if epoch % EVERY == 0 and t_ns in orbit
    ]


def measured(heard, epoch: int, sky: Sky, tag_s: float) -> Measurements:
    """P1 and P2 of an epoch, on a channel each, with the product's satellites. What left at the satellite's
    clock tag - P / c left at GPS time that much less its offset."""
    rows = []
    for row in np.flatnonzero(heard.epoch == epoch):
        sat = int(heard.sat[row])
        for code, signal in (("P1", SIGNAL["L1P"]), ("P2", SIGNAL["L2P"])):
            p = heard.obs[code][row]
            if np.isnan(p) or sat not in sky.column:
                continue
            *_, clock_s = sky.report(sat, tag_s - p / LIGHT_MPS)
            pos, vel, clock_s = sky.report(sat, tag_s - p / LIGHT_MPS - clock_s)
            if np.isfinite([*pos, clock_s]).all():
                rows.append((sat, signal, p, clock_s * LIGHT_MPS, *pos, *vel))
    sat, signal, p, clock_m, *motion = np.array(rows).reshape(-1, 10).T
    flat, whole = np.zeros(len(p)), np.arange(len(p))
    return Measurements(
        0 * whole, whole, sat.astype(int), p, flat, flat + 45, flat + 5, flat, flat,
        np.array(motion[:3]), np.array(motion[3:]), clock_m, flat, signal.astype(int), flat,
    )  # fmt: skip


RECEIVER = budget(ura_scale=5.0, code_noise_m={"L1P": 0.3, "L2P": 0.3})
"""It tracks P codes without knowing them; 45 dBHz stand for strengths that are left out here, and so are
antennas of satellites, which are metres from where the orbits are."""


def ranges(epoch: Epoch, combine=ionosphere_free) -> Ranges:
    return combine(epoch.measured, RECEIVER)


def fixed(m: Ranges, rules: Rules = STRICT) -> Fix:
    """By default weights; the receiver's antenna is the point sought."""
    nowhere = np.zeros((3, len(m)))
    fix = solve(m, nowhere, nowhere, np.zeros(len(m), int), None, RECEIVER, rules=rules)
    assert isinstance(fix, Fix), fix
    return fix


def errors_m(day, combine, rules: Rules = STRICT) -> np.ndarray:
    offered = [(epoch, ranges(epoch, combine)) for epoch in day]
    enough = [(epoch, m) for epoch, m in offered if len(m) >= 4]
    assert len(enough) > 0.95 * len(day)
    return np.array([np.linalg.norm(fixed(m, rules).position_m - epoch.position_m) for epoch, m in enough])


@pytest.mark.verifies(
    "flightsw/measurement/ionosphere_free.py",
    "flightsw/estimation/position.py",
    what="The flight software on a real receiver",
    by=(
        "GRACE-B against its published orbit, prepared apart: every epoch of 288 a fix, median 1.71 m, 95 % "
        "5.30 m"
    ),
    status="validated",
)
def test_every_epoch_with_four_satellites_is_a_fix_within_metres(day):
    """What was asked of a replay: median 2 m, 95 % below 6 m. Independent single-point positions of the same
    files: 1.71 m and 5.3 m."""
    found = errors_m(day, ionosphere_free)
    print(f"{len(found)} fixes, median {np.median(found):.2f} m, 95 % {np.percentile(found, 95):.2f} m")
    assert np.median(found) < 2 and np.percentile(found, 95) < 6


def test_one_frequency_is_worse_by_its_ionosphere(day):
    """Little, at solar minimum and for three times the noise of the pair. And it contradicts itself where the
    ionosphere is uneven: a fix in every epoch needs the lenient rule."""
    alone, pairs = errors_m(day, of_one_signal, Rules(refuse=False)), errors_m(day, ionosphere_free)
    print(f"one frequency: median {np.median(alone):.2f} m, 95 % {np.percentile(alone, 95):.2f} m")
    assert len(alone) >= len(pairs) and np.median(alone) > np.median(pairs)


@pytest.mark.parametrize("offset_s", [1e-3, -1e-3])
def test_a_clock_set_off_moves_the_tags_and_nothing_else(day, offset_s):
    """The same latch by a clock that is 1 ms off: ranges 300 km longer, tags 1 ms later."""
    for epoch in day[:40]:
        right = fixed(ranges(epoch))
        m = ranges(epoch)
        late = fixed(replace(m, pseudorange_m=m.pseudorange_m + LIGHT_MPS * offset_s))
        still = replace(late, velocity_mps=None, drift_mps=None)
        at_tag = propagated_to_mark(still, 1, epoch.velocity_mps)
        assert np.linalg.norm(at_tag.position_m - right.position_m) > 7
        expected_m = right.position_m + epoch.velocity_mps * (late.clock_m[0] / LIGHT_MPS)
        assert np.linalg.norm(at_tag.position_m - expected_m) < 1e-3
