"""GPS satellites from broadcast ephemerides: the user algorithm of IS-GPS-200."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.constellation.base import Broadcast
from gnss_hil.emulator.constellation.broadcast.ephemerides import latest_of_each, nearest_valid
from gnss_hil.emulator.earth.constants import LIGHT_MPS, ROTATION_RPS
from gnss_hil.emulator.files.rinex_nav import Records

MU_GPS_M3PS2 = 3.986005e14
"""IS-GPS-200, 20.3.3.4.3.3: the value broadcast orbits are fitted with."""

_RELATIVITY_F = -4.442807633e-10
"""-2 sqrt(mu) / c^2 [s / m^0.5]. IS-GPS-200, 20.3.3.3.3.1."""

_URA_LIMITS_M = (2.4, 3.4, 4.85, 6.85, 9.65, 13.65, 24, 48, 96, 192, 384, 768, 1536, 3072, 6144)
"""Largest accuracy of URA index 0, 1, ... IS-GPS-200, 20.3.3.3.1.3."""

_SHORTEST_FIT_H, _EXTENDED_FIT_H, _LONGEST_FIT_H = 4.0, 6.0, 146.0
"""Fit intervals of flag 0 and, at least, of flag 1; the longest. IS-GPS-200, 20.3.4.4, tables 20-XI, XII."""


@dataclass(frozen=True, slots=True, eq=False)
class GpsConstellation:
    """Ephemerides of GPS satellites, one a row, sorted by satellite and time.

    index    (n,) satellite index of the constellation's satellites
    number   (m,) PRN of each ephemeris
    toc_ns, toe_ns   (m,) clock's and orbit's reference, GPS time [ns]
    valid_ns (m,) half the fit interval [ns]
    fields   name (`rinex_layouts.GPS_FIELDS`) -> (m,)
    """

    index: I64
    number: I64
    toc_ns: I64
    toe_ns: I64
    valid_ns: I64
    fields: dict[str, F64]

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last GPS time at which any ephemeris is valid."""
        return int((self.toe_ns - self.valid_ns).min()), int((self.toe_ns + self.valid_ns).max())

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Broadcast]:
        """See `Constellation.sample`."""
        numbers = satellites.number_of(self.index)
        rows, valid = nearest_valid(self.number, self.toe_ns, self.valid_ns, numbers, middles_ns)
        eph = {name: column[rows][:, None, :] for name, column in self.fields.items()}
        toe_s = (self.toe_ns[rows] % gpstime.NS_PER_WEEK / gpstime.NS_PER_S)[:, None, :]
        since_toe_s = _since(self.toe_ns, rows, middles_ns, nodes_s)
        since_toc_s = _since(self.toc_ns, rows, middles_ns, nodes_s)
        positions, anomaly = orbit(eph, toe_s, since_toe_s)
        clocks = LIGHT_MPS * clock_s(eph, since_toc_s, anomaly)
        message = {name: self.fields[name][rows] for name in ("health", "iode", "ura_m", "tgd")}
        return (
            positions,
            clocks,
            Broadcast(
                available=valid,
                healthy=message["health"] == 0,
                frequency=np.zeros(rows.shape, np.int64),
                iod=message["iode"].astype(np.int64),
                ura=np.where(
                    message["ura_m"] < 0, len(_URA_LIMITS_M), np.searchsorted(_URA_LIMITS_M, message["ura_m"])
                ),
                ephemeris=rows,
                group_delay_m=LIGHT_MPS * message["tgd"],
                band_delay_m=np.zeros(rows.shape),
            ),
        )


def _since(reference_ns, rows, middles_ns, nodes_s) -> F64:
    """(s, k, n) seconds from the rows' reference times to all nodes."""
    middle_s = (middles_ns[:, None] - reference_ns[rows]) / gpstime.NS_PER_S
    return middle_s[:, None, :] + nodes_s[:, None]


def eccentric_anomaly_rad(mean_rad: F64, ecc: F64) -> F64:
    """Kepler's equation by Newton's method; converges to rounding in a few steps for GPS eccentricities."""
    anomaly = mean_rad + ecc * np.sin(mean_rad)
    for _ in range(5):
        anomaly = anomaly - (anomaly - ecc * np.sin(anomaly) - mean_rad) / (1 - ecc * np.cos(anomaly))
    return anomaly


def orbit(eph: dict[str, F64], toe_s: F64, since_toe_s: F64) -> tuple[F64, F64]:
    """Positions from broadcast elements.

    eph          name -> (..., n), names and units of RINEX, angles [rad]
    toe_s        (..., n) reference, second of week
    since_toe_s  (..., n) time from it [s]
    returns      (..., n, 3) WGS-84 ECEF of the instant, antenna phase centre [m]; (..., n) eccentric anomaly
    Source: IS-GPS-200, table 20-IV
    """
    semi_major_m = eph["sqrt_a"] ** 2
    motion = np.sqrt(MU_GPS_M3PS2 / semi_major_m**3) + eph["delta_n"]
    anomaly = eccentric_anomaly_rad(eph["m0"] + motion * since_toe_s, eph["e"])
    true = np.arctan2(np.sqrt(1 - eph["e"] ** 2) * np.sin(anomaly), np.cos(anomaly) - eph["e"])
    phi = true + eph["omega"]
    cos2, sin2 = np.cos(2 * phi), np.sin(2 * phi)
    latitude = phi + eph["cus"] * sin2 + eph["cuc"] * cos2
    radius_m = semi_major_m * (1 - eph["e"] * np.cos(anomaly)) + eph["crs"] * sin2 + eph["crc"] * cos2
    inclination = eph["i0"] + eph["idot"] * since_toe_s + eph["cis"] * sin2 + eph["cic"] * cos2
    node = eph["omega0"] + (eph["omega_dot"] - ROTATION_RPS) * since_toe_s - ROTATION_RPS * toe_s
    x, y = radius_m * np.cos(latitude), radius_m * np.sin(latitude)
    y_level = y * np.cos(inclination)
    position = np.stack(
        (
            x * np.cos(node) - y_level * np.sin(node),
            x * np.sin(node) + y_level * np.cos(node),
            y * np.sin(inclination),
        ),
        axis=-1,
    )
    return position, anomaly


def clock_s(eph: dict[str, F64], since_toc_s: F64, anomaly_rad: F64) -> F64:
    """Satellite clock for L1 C/A: polynomial, relativity, less group delay [s].

    Source: IS-GPS-200, 20.3.3.3.3.1 and 20.3.3.3.3.2
    """
    polynomial = eph["af0"] + since_toc_s * (eph["af1"] + since_toc_s * eph["af2"])
    relativity = _RELATIVITY_F * eph["e"] * eph["sqrt_a"] * np.sin(anomaly_rad)
    return polynomial + relativity - eph["tgd"]


def _fit_h(written: F64) -> F64:
    """Fit interval [h]; files write hours, or the bare flag 0 or 1. What no flag means is unknown."""
    flag_h = np.where(written == 1, _EXTENDED_FIT_H, _SHORTEST_FIT_H)
    return np.where((written > 1) & (written <= _LONGEST_FIT_H), written, flag_h)


def from_records(records: Records) -> GpsConstellation:
    """The constellation of the records of one or several files.

    The week of toe follows from the record's epoch, so that files with weeks modulo 1024 and
    ephemerides across the end of a week come out right.
    """
    toc_ns = np.array([gpstime.from_calendar(moment) for moment in records.epoch], np.int64)
    second_ns = np.rint(records.fields["toe"] * gpstime.NS_PER_S).astype(np.int64)
    half_week_ns = gpstime.NS_PER_WEEK // 2
    toe_ns = toc_ns + (second_ns - toc_ns + half_week_ns) % gpstime.NS_PER_WEEK - half_week_ns
    # Transmission times are seconds of week as well; counted from toe they run on across its end.
    sent_s = (records.fields["transmission"] - records.fields["toe"] + 302_400) % 604_800
    keep = latest_of_each(records.number, toe_ns, np.nan_to_num(sent_s, nan=-1.0))
    valid_ns = np.rint(_fit_h(records.fields["fit_h"]) * 1800 * gpstime.NS_PER_S).astype(np.int64)
    return GpsConstellation(
        index=satellites.index(satellites.GPS, np.unique(records.number)),
        number=records.number[keep],
        toc_ns=toc_ns[keep],
        toe_ns=toe_ns[keep],
        valid_ns=valid_ns[keep],
        fields={name: column[keep] for name, column in records.fields.items()},
    )
