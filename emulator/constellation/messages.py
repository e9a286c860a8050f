"""What satellites broadcast, as navigation records: the way back from a constellation to a file.

Of a sky of navigation files these are the records in use; of a nominal one they are made
(`emulator.constellation.nominal_messages`).

Datum. GLONASS records are PZ-90 of their date by the interface document. Receivers on the bus deliver WGS-84,
and most software of others takes records as they are: in WGS-84 they give the coordinates of the bus without
any transformation.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.constellation import nominal_messages
from gnss_hil.emulator.constellation.base import Constellation
from gnss_hil.emulator.constellation.broadcast.glonass import GlonassConstellation, derivative, to_wgs84
from gnss_hil.emulator.constellation.broadcast.gps import GpsConstellation
from gnss_hil.emulator.constellation.nominal import NominalConstellation
from gnss_hil.emulator.constellation.nominal_messages import Stretch, glonass_records
from gnss_hil.emulator.files.rinex_nav import Records

_MINUTE_NS = 60 * gpstime.NS_PER_S


def records(constellation: Constellation, stretch: Stretch, wgs84: bool = True) -> Records:
    """The navigation records of one system's satellites that serve a stretch of time.

    wgs84   GLONASS states in WGS-84 instead of PZ-90 as of their date
    The clock of a GLONASS record is that against GPS time less leap seconds: -tau_c is inside, and a file of
    these records states none. TypeError for a constellation of no known kind.
    """
    system = int(satellites.system_of(constellation.index[0]))
    maker = _MAKERS.get((type(constellation), system))
    if maker is None:
        raise TypeError("no navigation records: the sky is of precise orbits, which have none")
    return maker(constellation, stretch, wgs84)


def _in_use(constellation: Constellation, stretch: Stretch) -> I64:
    """Rows of the ephemerides that hold in some minute of the stretch."""
    minutes_ns = np.arange(stretch.begin_ns, stretch.end_ns + _MINUTE_NS, _MINUTE_NS)
    _, _, broadcast = constellation.sample(minutes_ns, np.zeros(1))
    return np.unique(broadcast.ephemeris[broadcast.available])


def _broadcast_gps(constellation: GpsConstellation, stretch: Stretch, wgs84: bool) -> Records:
    rows = _in_use(constellation, stretch)
    epoch = tuple(gpstime.to_calendar(t) for t in constellation.toc_ns[rows].tolist())
    return Records(constellation.number[rows], epoch, {k: v[rows] for k, v in constellation.fields.items()})


def _broadcast_glonass(constellation: GlonassConstellation, stretch: Stretch, wgs84: bool) -> Records:
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


_MAKERS: dict[tuple[type, int], Callable[..., Records]] = {
    (GpsConstellation, satellites.GPS): _broadcast_gps,
    (GlonassConstellation, satellites.GLONASS): _broadcast_glonass,
    (NominalConstellation, satellites.GPS): nominal_messages.gps_records,
    (NominalConstellation, satellites.GLONASS): nominal_messages.glonass_records_of,
}
"""Kind of constellation and system -> maker."""
