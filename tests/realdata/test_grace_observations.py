"""GRACE-B, 2010-07-27: what the readers and the precise orbits give, solved by a least squares of this file.

A pseudorange and the epoch tag come from the same clock, so that tag - P / c is when the satellite's clock
sent, however far the receiver's is off; the fix belongs to tag - offset. In this file the offset is at most
36 ns: somebody has steered tags and ranges to GPS time.
"""

from __future__ import annotations

import gzip
from datetime import date, datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.constellation import phase_centre, precise
from gnss_hil.emulator.files import rinex_obs, sp3
from tests.support.outside import data_file

pytestmark = pytest.mark.realdata

C, EARTH_RPS = 299_792_458.0, 7.2921151467e-5
F1_HZ, F2_HZ = 1575.42e6, 1227.60e6
FLIGHT_S = np.array((-0.11, -0.08, -0.05))
"""Three instants of a satellite's path before the tag: the parabola through them is good to micrometres."""


@pytest.fixture(scope="module")
def observations():
    return rinex_obs.read(data_file("grace_b_2010-07-27/GRCB2080.10D.gz"))


@pytest.fixture(scope="module")
def product():
    return sp3.joined([sp3.read(data_file(f"grace_b_2010-07-27/COD1594{day}.EPH.gz")) for day in (1, 2, 3)])


@pytest.fixture(scope="module")
def truth():
    """(e,) GPS time [s of day], (e, 3) place [m], (e, 3) velocity [m/s]."""
    text = gzip.decompress(data_file("grace_b_2010-07-27/grcb_truth.csv.gz").read_bytes()).decode("ascii")
    rows = [line.split(",") for line in text.splitlines()]
    start = datetime(2010, 7, 27)
    t_s = [(datetime.strptime(f"{r[0]} {r[1]}", "%d/%m/%Y %H:%M:%S") - start).total_seconds() for r in rows]
    values = np.array([[float(cell) for cell in row[2:8]] for row in rows])
    return np.array(t_s), 1e3 * values[:, :3], 0.1 * values[:, 3:]


def test_the_whole_file_is_read(observations):
    """Against counts that the text itself tells: satellites announced in its 8,640 epoch lines."""
    import hatanaka

    raw = gzip.decompress(data_file("grace_b_2010-07-27/GRCB2080.10D.gz").read_bytes())
    lines = hatanaka.crx2rnx(raw).decode("ascii").splitlines()
    heads = [line for line in lines if line.startswith(" 10 07 27")]
    assert len(observations.t_ns) == len(heads) == 8640
    assert len(observations.sat) == sum(int(line[29:32]) for line in heads)
    assert observations.header.codes == {"": ("L1", "L2", "C1", "P1", "P2", "LA", "SA", "S1", "S2")}
    assert set(np.diff(observations.t_ns).tolist()) == {10 * gpstime.NS_PER_S}
    # The file's last satellite, read by eye: column 1 of its first and its second line.
    first, second = lines[-2], lines[-1]
    assert observations.obs["L1"][-1] == float(first[:14])
    assert observations.obs["P2"][-1] == float(first[64:78])
    assert observations.obs["S2"][-1] == float(second[48:62])
    assert observations.lli["L1"][-1] == int(first[14])


def fixes(observations, orbits):
    """Places (e, 3) [m] and receiver clocks (e,) [m] by ionosphere-free ranges; nan where fewer than 4."""
    p1, p2 = observations.obs["P1"], observations.obs["P2"]
    range_m = (F1_HZ**2 * p1 - F2_HZ**2 * p2) / (F1_HZ**2 - F2_HZ**2)
    column = np.searchsorted(orbits.index, observations.sat)
    epochs = len(observations.t_ns)
    place, clock = np.full((epochs, 3), np.nan), np.full(epochs, np.nan)
    bounds = np.searchsorted(observations.epoch, np.arange(epochs + 1))
    for begin in range(0, epochs, 360):
        chunk = slice(begin, min(begin + 360, epochs))
        pos, clocks, there = orbits.sample(observations.t_ns[chunk], FLIGHT_S)
        for row in range(chunk.start, chunk.stop):
            seen = slice(bounds[row], bounds[row + 1])
            at = column[seen]
            use = there[row - begin, at] & np.isfinite(range_m[seen])
            at, ranges = at[use], range_m[seen][use]
            if len(at) >= 4:
                place[row], clock[row] = solved(pos[row - begin][:, at], clocks[row - begin][:, at], ranges)
    return place, clock


def solved(pos, clocks, ranges):
    """One epoch: satellites' parabolas (3, n, 3), clocks (3, n) [m], ranges (n,) [m]."""
    back_s = -(ranges + clocks[1]) / C
    share = np.array(
        [np.prod([(back_s - t) / (own - t) for t in FLIGHT_S if t != own], axis=0) for own in FLIGHT_S]
    )
    sent = np.einsum("kn,knj->nj", share, pos)
    corrected = ranges + np.einsum("kn,kn->n", share, clocks)
    x, bias = np.zeros(3), 0.0
    for _ in range(12):
        angle = EARTH_RPS * np.linalg.norm(sent - x, axis=1) / C
        cos, sin = np.cos(angle), np.sin(angle)
        turned = np.stack(
            (cos * sent[:, 0] + sin * sent[:, 1], cos * sent[:, 1] - sin * sent[:, 0], sent[:, 2]), axis=1
        )
        line = turned - x
        distance = np.linalg.norm(line, axis=1)
        design = np.column_stack((-line / distance[:, None], np.ones(len(ranges))))
        step = np.linalg.lstsq(design, corrected - distance - bias, rcond=None)[0]
        x, bias = x + step[:3], bias + step[3]
        if np.abs(step).max() < 1e-4:
            break
    return x, bias


def flown(truth, t_s):
    """Truth (e, 3) at t_s (e,) by the cubic through places and velocities of the two rows around."""
    told_s, pos, vel = truth
    k = np.clip(np.searchsorted(told_s, t_s, side="right") - 1, 0, len(told_s) - 2)
    h = (told_s[k + 1] - told_s[k])[:, None]
    u = (t_s - told_s[k])[:, None] / h
    # Velocities relative to the turning axes, so that the cubic is one of places in them.
    return (
        (1 + 2 * u) * (1 - u) ** 2 * pos[k]
        + u * (1 - u) ** 2 * h * vel[k]
        + u**2 * (3 - 2 * u) * pos[k + 1]
        + u**2 * (u - 1) * h * vel[k + 1]
    )


def errors(observations, orbits, truth):
    """3-D errors (e,) and their radial parts (e,) [m] of the epochs that have a fix."""
    place, clock = fixes(observations, orbits)
    tag_s = (observations.t_ns - gpstime.from_calendar(datetime(2010, 7, 27))) / gpstime.NS_PER_S
    true = flown(truth, tag_s - clock / C)
    miss = (place - true)[np.isfinite(clock)]
    up = (true / np.linalg.norm(true, axis=1, keepdims=True))[np.isfinite(clock)]
    return np.linalg.norm(miss, axis=1), np.einsum("ej,ej->e", miss, up)


@pytest.mark.verifies(
    "emulator/files/rinex_obs.py",
    "emulator/files/rinex_obs_header.py",
    "emulator/files/rinex_epochs.py",
    "emulator/files/columns.py",
    what="Observation files",
    by=(
        "fixes from a day of GRACE-B and CODE orbits, solved apart: median 0.98 m, 95 % 3.1 m; from centres "
        "of mass 1.82 m, independently found 1.71 m; RTKLIB's convbin reads the same 262,860 numbers"
    ),
    status="validated",
)
def test_ionosphere_free_fixes_against_the_published_orbit(observations, product, truth):
    """Independently found with the same files, from centres of mass: median 1.71 m, 95 % 5.3 m, radial mean
    +0.63 m (the antenna is above the craft's centre of mass). From phase centres it must come out better."""
    found = {}
    for name, offset_m in (("mass", None), ("phase", phase_centre.offsets_m(date(2010, 7, 27)))):
        error, radial = errors(observations, precise.from_sp3(product, offset_m), truth)
        found[name] = *np.percentile(error, (50, 95)), radial.mean()
        print(
            f"GRACE-B from centres of {name}: {len(error)} fixes, median {found[name][0]:.2f} m, "
            f"95 % {found[name][1]:.2f} m, radial mean {found[name][2]:+.2f} m"
        )
        assert len(error) > 8600
    median, p95, radial = found["mass"]
    assert median == pytest.approx(1.71, abs=0.15)
    assert p95 == pytest.approx(5.3, abs=0.3)
    assert radial == pytest.approx(0.63, abs=0.1)
    median, p95, radial = found["phase"]
    assert median < 1.1
    assert p95 < 3.4
    assert radial == pytest.approx(0.63, abs=0.2)
