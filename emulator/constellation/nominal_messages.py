"""Navigation records for a nominal sky, made as a control segment would make them.

Circular GPS orbits are a case of IS-GPS-200's elements and come out exact. A uniform circular motion is
none of the GLONASS interface document's, whose satellites feel the Earth's oblateness: those records are
fitted to the stretch that each serves, which leaves 1 cm (rms of the position) over eight minutes and 7 cm
over a whole quarter of an hour.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.constellation.broadcast.glonass import datum_at, derivative, from_wgs84, propagate
from gnss_hil.emulator.constellation.broadcast.gps import MU_GPS_M3PS2
from gnss_hil.emulator.constellation.nominal import NominalConstellation
from gnss_hil.emulator.earth.constants import ROTATION_RPS
from gnss_hil.emulator.files.rinex_layouts import GLONASS_FIELDS, GPS_FIELDS
from gnss_hil.emulator.files.rinex_nav import Records

_GPS_SPACING_NS = 7200 * gpstime.NS_PER_S
_GLONASS_SPACING_NS = 900 * gpstime.NS_PER_S
"""New GPS records come every two hours; GLONASS reference times are quarters of an hour of UTC, and readers
(RTKLIB) round to them."""

_FIT_H = 4.0
_URA_M = 2.0
"""Accuracy index 0 in metres. IS-GPS-200, 20.3.3.3.1.3."""

_NODES = 21
_SHORTEST_ARC_S = 120.0
"""A shorter arc does not separate nine parameters."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """The time that records have to serve, GPS time [ns]."""

    begin_ns: int
    end_ns: int

    def references_ns(self, spacing_ns: int, origin_ns: int) -> I64:
        """Times on a grid, each the nearest to some instant of the stretch."""
        first, last = ((t - origin_ns + spacing_ns // 2) // spacing_ns for t in (self.begin_ns, self.end_ns))
        return origin_ns + spacing_ns * np.arange(first, last + 1)


def gps_records(c: NominalConstellation, stretch: Stretch, wgs84: bool) -> Records:
    """Elements of circular orbits. Source: IS-GPS-200, table 20-IV, read backwards with e = 0."""
    references_ns = stretch.references_ns(_GPS_SPACING_NS, 0)
    times, n = len(references_ns), len(c.index)
    toe_ns = np.repeat(references_ns, n)
    age_s = (toe_ns - c.epoch_ns) / gpstime.NS_PER_S
    toe_s = toe_ns % gpstime.NS_PER_WEEK / gpstime.NS_PER_S
    offset_s, rate, group_delay_s = (np.tile(v, times) for v in (*c.clocks, c.delays_s[0]))
    issue = toe_ns % gpstime.NS_PER_WEEK // _GPS_SPACING_NS  # programs distinguish records by it
    known = {
        "af0": offset_s + rate * age_s + group_delay_s,
        "af1": rate,
        "tgd": group_delay_s,
        "iode": issue,
        "iodc": issue,
        "delta_n": c.latitude_rps - np.sqrt(MU_GPS_M3PS2 / c.radius_m**3),
        "m0": half_turns(np.tile(c.latitude_rad, times) + c.latitude_rps * age_s),
        "sqrt_a": np.sqrt(c.radius_m),
        "toe": toe_s,
        "omega0": half_turns(np.tile(c.node_rad, times) + c.node_rps * age_s + ROTATION_RPS * toe_s),
        "i0": c.inclination_rad,
        "omega_dot": c.node_rps + ROTATION_RPS,
        "week": toe_ns // gpstime.NS_PER_WEEK,
        "ura_m": _URA_M,
        "transmission": toe_s,
        "fit_h": _FIT_H,
    }
    epoch = tuple(gpstime.to_calendar(t) for t in toe_ns.tolist())
    number = np.tile(satellites.number_of(c.index), times)
    return Records(number, epoch, _columns(known, GPS_FIELDS, len(epoch)))


def half_turns(angle_rad: F64) -> F64:
    """Angles within half a turn of zero."""
    return (angle_rad + np.pi) % (2 * np.pi) - np.pi


def _columns(known: dict, names: tuple[str, ...], m: int) -> dict[str, F64]:
    """All fields (m,) of records, zero where nothing is known."""
    return {name: np.broadcast_to(np.asarray(known.get(name, 0.0), float), m) for name in names}


def glonass_records_of(c: NominalConstellation, stretch: Stretch, wgs84: bool) -> Records:
    """States and extra accelerations fitted to circular motions, in WGS-84 or PZ-90 as of the date."""
    origin_ns = gpstime.leap_seconds(stretch.begin_ns) * gpstime.NS_PER_S
    references_ns = stretch.references_ns(_GLONASS_SPACING_NS, origin_ns)
    half_ns = _GLONASS_SPACING_NS // 2
    fits = []
    for tb_ns in references_ns.tolist():
        arc_ns = max(stretch.begin_ns, tb_ns - half_ns), min(stretch.end_ns, tb_ns + half_ns)
        begin_s, end_s = ((t - tb_ns) / gpstime.NS_PER_S for t in arc_ns)
        datum = None if wgs84 else datum_at(gpstime.to_calendar(tb_ns - origin_ns))
        fits.append(_fitted(c, tb_ns, begin_s, end_s, datum))
    times, n = len(fits), len(c.index)
    tb_ns = np.repeat(references_ns, n)
    offset_s, rate = (np.tile(v, times) for v in c.clocks)
    found = np.concatenate(fits)
    return glonass_records(
        np.tile(satellites.number_of(c.index), times),
        tb_ns,
        found,
        offset_s + rate * ((tb_ns - c.epoch_ns) / gpstime.NS_PER_S),
        rate,
        np.tile(c.frequency, times),
        np.zeros(len(tb_ns), bool),
    )


def _fitted(c: NominalConstellation, tb_ns: int, begin_s: float, end_s: float, datum: int | None) -> F64:
    """(n, 9) states at tb and extra accelerations that follow the motions best, begin_s to end_s after tb.

    Least squares at Chebyshev nodes, by Gauss and Newton from the state of the motion itself; three steps
    reach the rounding.
    """
    middle, half = (begin_s + end_s) / 2, max(end_s - begin_s, _SHORTEST_ARC_S) / 2
    nodes_s = middle + half * np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    positions, _, _ = c.sample(np.array([tb_ns]), np.concatenate((nodes_s, (-1.0, 0.0, 1.0))))
    positions = positions[0] if datum is None else from_wgs84(positions[0], np.array(datum))
    wanted, (before, there, after) = positions[:_NODES], positions[_NODES:]
    state = np.concatenate((there, (after - before) / 2), axis=1)
    pull = derivative(state, np.zeros_like(there))[:, 3:]
    found = np.concatenate((state, after - 2 * there + before - pull), axis=1)
    units = np.repeat((1.0, 1 / half, 1 / half**2), 3)  # of about a metre at the ends of the arc
    steps = np.concatenate((np.zeros((1, 9)), np.diag(units)))
    n = len(found)
    for _ in range(3):
        varied = found + steps[:, None]
        start = np.broadcast_to(varied[..., :6], (_NODES, 10, n, 6))
        ages_s = np.broadcast_to(nodes_s[:, None, None], (_NODES, 10, n))
        paths = propagate(start, varied[..., 6:], ages_s)[..., :3]
        design = (paths[:, 1:] - paths[:, :1]).transpose(2, 0, 3, 1).reshape(n, -1, 9)
        misfit = (wanted - paths[:, 0]).transpose(1, 0, 2).reshape(n, -1)
        normal, right = np.einsum("nij,nik->njk", design, design), np.einsum("nij,ni->nj", design, misfit)
        found = found + units * np.linalg.solve(normal, right[..., None])[..., 0]
    return found


def glonass_records(
    number: I64,
    tb_ns: I64,
    motion: F64,
    clock_s: F64,
    clock_rate: F64,
    frequency: I64,
    unhealthy: Bool,
) -> Records:
    """Records of GLONASS satellites, as files write them.

    motion   (m, 9) position, velocity and extra acceleration [m, m/s, m/s^2];  the others (m,)
    """
    utc = [gpstime.to_calendar(t - gpstime.leap_seconds(t) * gpstime.NS_PER_S) for t in tb_ns.tolist()]
    known = {
        "minus_tau": clock_s,
        "gamma": clock_rate,
        "message_time": [t.isoweekday() % 7 * 86400 + t.hour * 3600 + t.minute * 60 + t.second for t in utc],
        "health": unhealthy,
        "frequency": frequency,
        **{f"{axis}_km": motion[:, i] / 1e3 for i, axis in enumerate("xyz")},
        **{f"v{axis}_kmps": motion[:, 3 + i] / 1e3 for i, axis in enumerate("xyz")},
        **{f"a{axis}_kmps2": motion[:, 6 + i] / 1e3 for i, axis in enumerate("xyz")},
    }
    return Records(number, tuple(utc), _columns(known, GLONASS_FIELDS, len(utc)))
