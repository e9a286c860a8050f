"""GLONASS satellites from broadcast ephemerides: integration by the interface control document."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from math import ceil

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.constellation.base import Broadcast
from gnss_hil.emulator.constellation.broadcast.ephemerides import latest_of_each, nearest_valid
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.files.rinex_nav import Records

# PZ-90 constants. GLONASS ICD 5.1 (2008), appendix A.3.1.2 and table 3.2.
MU_PZ90_M3PS2 = 398_600.4418e9
RADIUS_PZ90_M = 6_378_136.0
J2_PZ90 = 1_082_625.75e-9
ROTATION_PZ90_RPS = 7.292115e-5

VALID_NS = 15 * 60 * gpstime.NS_PER_S
"""An ephemeris serves 15 minutes either side of tb. GLONASS ICD 5.1, A.3.1.2."""

_LONGEST_STEP_S = 20.0
"""Step of the fourth-order Runge-Kutta integration: 15 minutes to 2 um."""

URA = 3
"""Accuracy index of records that carry none: 4.85 to 6.85 m, what their orbits show against precise ones."""


@dataclass(frozen=True, slots=True)
class Datum:
    """Helmert transformation to WGS-84, coordinate frame convention, in force from a date on.

    shift_m        (3,) [m]
    rotation_mas   (3,) about x, y, z [milliarcsecond]
    scale          [-]
    """

    since: datetime
    shift_m: tuple[float, float, float]
    rotation_mas: tuple[float, float, float] = (0, 0, 0)
    scale: float = 0.0


DATUMS = (
    # PZ-90: to PZ-90.02 by GOST R 51794-2008 (EPSG 7702), then as below.
    Datum(datetime(1982, 10, 12), (-1.43, 0.05, 0.20), (0, 0, -130), -0.22e-6),
    # PZ-90.02: ICD GLONASS 5.1, 3.3.4 (EPSG 7961, reversed).
    Datum(datetime(2007, 9, 20), (-0.36, 0.08, 0.18)),
    # PZ-90.11: to ITRF2008 by GOST 32453-2017 (EPSG 7960), which WGS-84 (G1674) and later follow within 1 cm.
    Datum(datetime(2013, 12, 31), (-0.003, -0.001, 0.0), (0.019, -0.042, 0.002)),
)
"""WGS-84 from what GLONASS broadcast, by date."""


@dataclass(frozen=True, slots=True, eq=False)
class GlonassConstellation:
    """Ephemerides of GLONASS satellites, one a row, sorted by satellite and time.

    index      (n,) satellite index of the constellation's satellites
    number     (m,) slot of each ephemeris
    tb_ns      (m,) reference, GPS time [ns]
    tb_index   (m,) quarters of an hour of the Moscow day
    state      (m, 6) position [m] and velocity [m/s] at tb, PZ-90 as of then
    luni_solar (m, 3) acceleration by Sun and Moon [m/s^2]
    clock_s    (m,) satellite clock against GPS time less leap seconds at tb [s]; clock_rate (m,) [-]
    healthy    (m,) bool; frequency (m,) frequency number
    band_delay_s   (m,) Delta tau_n, by which L2 leaves later than L1; 0 where files have none [s]
    datum      (m,) row of DATUMS
    """

    index: I64
    number: I64
    tb_ns: I64
    tb_index: I64
    state: F64
    luni_solar: F64
    clock_s: F64
    clock_rate: F64
    healthy: Bool
    frequency: I64
    datum: I64
    band_delay_s: F64

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last GPS time at which any ephemeris is valid."""
        return int(self.tb_ns.min()) - VALID_NS, int(self.tb_ns.max()) + VALID_NS

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Broadcast]:
        """See `Constellation.sample`."""
        numbers = satellites.number_of(self.index)
        valid_ns = np.full(len(self.number), VALID_NS)
        rows, valid = nearest_valid(self.number, self.tb_ns, valid_ns, numbers, middles_ns)
        age_s = np.where(valid, (middles_ns[:, None] - self.tb_ns[rows]) / gpstime.NS_PER_S, 0.0)
        luni_solar = self.luni_solar[rows]
        middle = propagate(self.state[rows], luni_solar, age_s)
        nodes = propagate(middle[:, None], luni_solar[:, None], nodes_s[:, None])
        since_tb_s = age_s[:, None, :] + nodes_s[:, None]
        clocks = LIGHT_MPS * (self.clock_s[rows][:, None] + self.clock_rate[rows][:, None] * since_tb_s)
        return (
            to_wgs84(nodes[..., :3], self.datum[rows][:, None]),
            clocks,
            Broadcast(
                available=valid,
                healthy=self.healthy[rows],
                frequency=self.frequency[rows],
                iod=self.tb_index[rows],
                ura=np.full(rows.shape, URA),
                ephemeris=rows,
                group_delay_m=np.zeros(rows.shape),
                band_delay_m=LIGHT_MPS * self.band_delay_s[rows],
            ),
        )


def propagate(state: F64, luni_solar: F64, age_s: F64) -> F64:
    """States (..., 6) after age_s (...,), by Runge-Kutta steps of equal number for all."""
    steps = max(1, ceil(np.abs(age_s).max() / _LONGEST_STEP_S))
    h = (age_s / steps)[..., None]
    for _ in range(steps):
        k1 = derivative(state, luni_solar)
        k2 = derivative(state + h / 2 * k1, luni_solar)
        k3 = derivative(state + h / 2 * k2, luni_solar)
        k4 = derivative(state + h * k3, luni_solar)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state


def derivative(state: F64, luni_solar: F64) -> F64:
    """Rate of the state (..., 6) in the rotating frame: central force, J2, Earth's rotation, Sun and Moon.

    Source: GLONASS ICD 5.1, A.3.1.2, equations (1)
    """
    x, y, z, vx, vy, _ = np.moveaxis(state, -1, 0)
    r2 = x * x + y * y + z * z
    central = MU_PZ90_M3PS2 / (r2 * np.sqrt(r2))
    oblate = 1.5 * J2_PZ90 * central * RADIUS_PZ90_M**2 / r2
    polar = 5 * z * z / r2
    w = ROTATION_PZ90_RPS
    level = w * w - central - oblate * (1 - polar)
    rate = np.empty(np.broadcast_shapes(state.shape, (*luni_solar.shape[:-1], 6)))
    rate[..., :3] = state[..., 3:]
    rate[..., 3] = level * x + 2 * w * vy
    rate[..., 4] = level * y - 2 * w * vx
    rate[..., 5] = -(central + oblate * (3 - polar)) * z
    rate[..., 3:] += luni_solar
    return rate


def to_wgs84(pos_pz90_m: F64, datum: I64) -> F64:
    """Positions (..., 3) in the PZ-90 of DATUMS[datum] (...,) as WGS-84 [m]."""
    matrices, shifts = _HELMERT
    return np.einsum("...ij,...j->...i", matrices[datum], pos_pz90_m) + shifts[datum]


def from_wgs84(pos_wgs84_m: F64, datum: I64) -> F64:
    """Positions (..., 3) in WGS-84 as PZ-90 of DATUMS[datum] (...,) [m]."""
    matrices, shifts = _HELMERT
    moved_m = (pos_wgs84_m - shifts[datum])[..., None]
    return np.asarray(np.linalg.solve(matrices[datum], moved_m)[..., 0], np.float64)


def datum_at(utc: datetime) -> int:
    """The row of DATUMS in force; the first also before it began."""
    return sum(utc >= datum.since for datum in DATUMS[1:])


def _helmert() -> tuple[F64, F64]:
    """(d, 3, 3) matrices and (d, 3) shifts of the DATUMS."""
    matrices = []
    for datum in DATUMS:
        rx, ry, rz = np.deg2rad(np.array(datum.rotation_mas) / 3.6e6)
        turn = np.array(((1, rz, -ry), (-rz, 1, rx), (ry, -rx, 1)))
        matrices.append((1 + datum.scale) * turn)
    return np.array(matrices), np.array([datum.shift_m for datum in DATUMS])


_HELMERT = _helmert()


def from_records(records: Records, glonass_to_utc_s: F64) -> GlonassConstellation:
    """The constellation of the records of one or several files.

    glonass_to_utc_s  (m,) -tau_c of the file each record came from [s]: GLONASS time minus UTC
    """
    f = records.fields
    tb_ns = np.array([gpstime.from_utc(moment) for moment in records.epoch], np.int64)
    keep = latest_of_each(records.number, tb_ns, np.nan_to_num(f["message_time"], nan=-np.inf))
    metres = 1e3 * np.stack(
        [f[f"{p}{axis}_{u}"] for p, u in (("", "km"), ("v", "kmps"), ("a", "kmps2")) for axis in "xyz"], 1
    )
    moscow_s = np.array([(m.hour + 3) % 24 * 3600 + m.minute * 60 + m.second for m in records.epoch])
    datum = np.array([datum_at(moment) for moment in records.epoch])
    return GlonassConstellation(
        index=satellites.index(satellites.GLONASS, np.unique(records.number)),
        number=records.number[keep],
        tb_ns=tb_ns[keep],
        tb_index=(moscow_s // 900)[keep],
        state=metres[keep, :6],
        luni_solar=metres[keep, 6:],
        clock_s=(f["minus_tau"] + glonass_to_utc_s)[keep],
        clock_rate=f["gamma"][keep],
        healthy=(f["health"] == 0)[keep],
        frequency=f["frequency"].astype(np.int64)[keep],
        datum=datum[keep],
        band_delay_s=f.get("delta_tau", np.zeros(len(keep)))[keep],
    )
