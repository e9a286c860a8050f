"""What satellites broadcast, as navigation records: the way back from a constellation to a file.

Of a sky of navigation files these are the records in use; of a nominal one they are made
(`gnss_hil.emulator.constellation.nominal_messages`). Which system has which of these functions:
`gnss_hil.emulator.constellation.registry`.

Datum. GLONASS records are PZ-90 of their date by the interface document. Receivers on the bus deliver WGS-84,
and most software of others takes records as they are: in WGS-84 they give the coordinates of the bus without
any transformation.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.constellation.base import Constellation
from gnss_hil.emulator.constellation.broadcast import glonass, gps
from gnss_hil.emulator.constellation.broadcast.glonass import GlonassConstellation, derivative, to_wgs84
from gnss_hil.emulator.constellation.broadcast.gps import GpsConstellation
from gnss_hil.emulator.constellation.nominal_messages import Stretch, glonass_records
from gnss_hil.emulator.files.rinex_nav import Records

_MINUTE_NS = 60 * gpstime.NS_PER_S


def _in_use(constellation: Constellation, stretch: Stretch) -> I64:
    """Rows of the ephemerides that hold in some minute of the stretch."""
    minutes_ns = np.arange(stretch.begin_ns, stretch.end_ns + _MINUTE_NS, _MINUTE_NS)
    _, _, broadcast = constellation.sample(minutes_ns, np.zeros(1))
    return np.unique(broadcast.ephemeris[broadcast.available])


def broadcast_gps(constellation: GpsConstellation, stretch: Stretch, wgs84: bool) -> Records:
    """The records in use; their orbits are WGS-84 either way."""
    rows = _in_use(constellation, stretch)
    epoch = tuple(gpstime.to_calendar(t) for t in constellation.toc_ns[rows].tolist())
    return Records(constellation.number[rows], epoch, {k: v[rows] for k, v in constellation.fields.items()})


def broadcast_glonass(constellation: GlonassConstellation, stretch: Stretch, wgs84: bool) -> Records:
    """The records in use, in WGS-84 or in PZ-90 as of their date.

    The clock of a record is that against GPS time less leap seconds: -tau_c is inside, and a file of these
    records states none.
    """
    rows = _in_use(constellation, stretch)
    state, extra = constellation.state[rows], constellation.luni_solar[rows]
    if wgs84:
        state, extra = in_wgs84(state, extra, constellation.datum[rows])
    return glonass_records(
        constellation.number[rows],
        constellation.tb_ns[rows],
        np.concatenate((state, extra), axis=1),
        constellation.clock_s[rows],
        constellation.clock_rate[rows],
        constellation.frequency[rows],
        ~constellation.healthy[rows],
    )


def in_wgs84(state: F64, extra: F64, datum: I64) -> tuple[F64, F64]:
    """States (m, 6) and luni-solar accelerations (m, 3) of records as those of the same motions in WGS-84.

    Integrated, the new state has the Earth in the new origin: what that shift changes of its pull goes to the
    extra acceleration.
    """
    origin = to_wgs84(np.zeros((len(state), 3)), datum)
    velocity, acceleration = (
        to_wgs84(vector, datum) - origin for vector in (state[:, 3:], derivative(state, extra)[:, 3:])
    )
    moved = np.concatenate((to_wgs84(state[:, :3], datum), velocity), axis=1)
    return moved, acceleration - derivative(moved, np.zeros_like(extra))[:, 3:]


def gps_places(found: Records, number: I64, t_ns: I64) -> F64:
    """(k, 3) where the records put satellites of these numbers (k,) at the instants t_ns (k,) [m], ECEF."""
    broadcast = gps.from_records(found)
    pick, age_s = _nearest(broadcast.number, broadcast.toe_ns, number, t_ns)
    elements = {name: column[pick] for name, column in broadcast.fields.items()}
    return gps.orbit(elements, elements["toe"], age_s)[0]


def glonass_places(found: Records, number: I64, t_ns: I64) -> F64:
    """The same, in the records' own frame."""
    broadcast = glonass.from_records(found, np.zeros(len(found)))
    pick, age_s = _nearest(broadcast.number, broadcast.tb_ns, number, t_ns)
    return glonass.propagate(broadcast.state[pick], broadcast.luni_solar[pick], age_s)[:, :3]


def _nearest(numbers: I64, references_ns: I64, number: I64, t_ns: I64) -> tuple[I64, F64]:
    """(k,) each satellite's record, of (m,), nearest to t_ns (k,), and the time from its reference [s]."""
    away_ns = t_ns[:, None] - references_ns
    strange = number[:, None] != numbers
    pick = np.argmin(np.abs(away_ns) + strange * (np.iinfo(np.int64).max // 4), axis=1)
    return pick, away_ns[np.arange(len(pick)), pick] / gpstime.NS_PER_S
