"""How long it takes to collect an ephemeris: which parts of its frame a receiver needs.

A frame is made of units (subframes, strings) that are only of use whole. Who begins to listen inside one has
to wait until it comes again; those needed may come in any order, from two frames (modelled: the ephemeris
does not change between them, and nothing is received wrong).

    GPS      subframes 1 to 3 of 5, 6 s each: 18 to 36 s       IS-GPS-200, 20.3.2 and 20.3.3
    GLONASS  strings 1 to 4 of 15, 2 s each: 8 to 32 s         GLONASS ICD 5.1 (2008), 4.3 and 4.4

Frames are timed where they are sent; the tenth of a second on the way is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import gpstime, systems
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.gpstime import NS_PER_S


@dataclass(frozen=True, slots=True)
class Frame:
    """How one system's message is framed.

    unit_s   length of a unit [s];  needed  how many from the first on;  units  of a frame
    by_utc   frames begin with days of UTC, not with weeks of GPS time
    """

    unit_s: int
    needed: int
    units: int
    by_utc: bool = False


FRAMES = {"gps": Frame(6, 3, 5), "glonass": Frame(2, 4, 15, by_utc=True)}
"""By name of the system. GLONASS frames begin with days of UTC + 3 h, hence with half minutes of UTC."""


def _column(of: Callable[[Frame], int]) -> I64:
    """A property of FRAMES as (8,) over systems; 0 where a system has no row."""
    return systems.column(lambda system: of(FRAMES[system.name]) if system.name in FRAMES else 0, 0)


_UNIT_NS = NS_PER_S * _column(lambda frame: frame.unit_s)
_NEEDED, _UNITS = _column(lambda frame: frame.needed), _column(lambda frame: frame.units)
_BY_UTC = _column(lambda frame: frame.by_utc) != 0


def collection_ns(system: I64, begins_ns: I64) -> I64:
    """Time to collect an ephemeris (...,) [ns] of satellites received from begins_ns (...,) on (GPS time).

    system  (...,) of the satellites; ValueError for one whose frames are not known
    """
    unit_ns, needed, units = _UNIT_NS[system], _NEEDED[system], _UNITS[system]
    if not unit_ns.all():
        unknown = int(np.asarray(system)[unit_ns == 0].flat[0])
        row = systems.by_value(unknown)
        raise ValueError(f"no frame structure of system {row.name if row else unknown}")
    of_frame_ns = (begins_ns - np.where(_BY_UTC[system], _leap_ns(begins_ns), 0)) % (units * unit_ns)
    # Units that have begun: all that are over, and the one that is cut.
    under_way = -(-of_frame_ns // unit_ns)
    ends = np.where(under_way == 0, needed, units + np.minimum(under_way, needed))
    return ends * unit_ns - of_frame_ns


def units_begun(system: I64, t_ns: I64) -> I64:
    """How many units (subframes, strings) satellites of these systems (...,) have begun until t_ns (...,),
    GPS time, counted from anywhere; where frames are not known, one every nanosecond."""
    return (t_ns - np.where(_BY_UTC[system], _leap_ns(t_ns), 0)) // np.maximum(_UNIT_NS[system], 1)


def _leap_ns(t_ns: I64) -> I64:
    """GPS - UTC (...,) [ns] at GPS times (...,)."""
    times = np.ravel(t_ns)
    ends = {gpstime.leap_seconds(int(t)) for t in (times.min(), times.max())} if len(times) else {0}
    if len(ends) == 1:
        return np.full(np.shape(t_ns), ends.pop() * NS_PER_S)
    leap_s = [gpstime.leap_seconds(t) for t in times.tolist()]
    return np.reshape(leap_s, np.shape(t_ns)) * NS_PER_S
