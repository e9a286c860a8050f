"""What messages of nominal satellites are off: errors of a report, put into each system's records.

A message is of one upload, of that in force at its reference time. While it serves, its orbit goes on as the
free orbit that it is, and its clock error stands still (modelled): what an atomic clock wanders until the
next message is what that one differs by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.constellation.base import ReportErrors
from gnss_hil.emulator.constellation.nominal import NominalConstellation
from gnss_hil.emulator.constellation.nominal_messages import half_turns
from gnss_hil.emulator.constellation.uploads import MINUTE_NS
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.files.rinex_nav import Records

_STEP_S = 30.0
"""Of differences in time, for rates."""


def gps(made: Records, c: NominalConstellation, errors: Sequence[ReportErrors]) -> Records:
    """Elements of orbits close by, to the first order; made: records of circles, all satellites at each time.

    Of a circle of radius a, ex = e cos(omega) and ey = e sin(omega) move a satellite at the argument of
    latitude u by -a (ex cos u + ey sin u) outwards and 2 a (ex sin u - ey cos u) ahead, di and dnode by
    a (di sin u - dnode sin i cos u) along the normal: Kepler's motion, IS-GPS-200, table 20-IV, with e small.
    """
    toe_ns = np.array([gpstime.from_calendar(t) for t in made.epoch], np.int64)
    axes, off_m, off_clock_s = _off(c, toe_ns, errors)
    up, ahead, normal = np.moveaxis(np.einsum("tknaj,tknj->tkna", axes, off_m) / c.radius_m, -1, 0)
    outward, along, across = up[:, 1], ahead[:, 1], normal[:, 1]
    outward_rate, across_rate = (_rate(part) / c.latitude_rps for part in (up, normal))
    latitude = c.latitude_rad + c.latitude_rps * _age_s(c, toe_ns)
    cos, sin, tilt = np.cos(latitude), np.sin(latitude), c.inclination_rad
    ex, ey = outward_rate * sin - outward * cos, -outward_rate * cos - outward * sin
    node = (across_rate * sin - across * cos) / np.sin(tilt)
    further = along - 2 * outward_rate - node * np.cos(tilt)
    perigee = np.arctan2(ey, ex)
    changes = {
        "e": np.hypot(ex, ey),
        "omega": perigee,
        "m0": further - perigee,
        "omega0": node,
        "i0": across * sin + across_rate * cos,
        "af0": off_clock_s,
    }
    moved = _added(made, changes)
    turned = {name: half_turns(moved.fields[name]) for name in ("m0", "omega0")}
    return replace(moved, fields={**moved.fields, **turned})


def glonass(made: Records, c: NominalConstellation, errors: Sequence[ReportErrors]) -> Records:
    """States moved, from which the messages' equations go on as from any other."""
    tb_ns = np.array([gpstime.from_utc(t) for t in made.epoch], np.int64)
    _, off_m, off_clock_s = _off(c, tb_ns, errors)
    places = {f"{axis}_km": off_m[:, 1, :, i] / 1e3 for i, axis in enumerate("xyz")}
    rates = {f"v{axis}_kmps": _rate(off_m)[..., i] / 1e3 for i, axis in enumerate("xyz")}
    return _added(made, {**places, **rates, "minus_tau": off_clock_s})


def _added(made: Records, changes: dict[str, F64]) -> Records:
    changed = {name: made.fields[name] + change.ravel() for name, change in changes.items()}
    return replace(made, fields={**made.fields, **changed})


def _rate(values: F64) -> F64:
    """Rates (t, ...) at the middle of three instants (t, 3, ...)."""
    return (values[:, 2] - values[:, 0]) / (2 * _STEP_S)


def _age_s(c: NominalConstellation, reference_ns: I64) -> F64:
    """(t, 1) time since the constellation's epoch, of reference times of all satellites (t n,)."""
    return (reference_ns[:: len(c.index), None] - c.epoch_ns) / gpstime.NS_PER_S


def _off(c: NominalConstellation, reference_ns: I64, errors: Sequence[ReportErrors]) -> tuple[F64, F64, F64]:
    """What is reported less what flies, around reference times of all satellites (t n,).

    returns  (t, 3, n, 3, 3) rows up, ahead and along the orbit's normal;  (t, 3, n, 3) positions [m]: both at
             three instants, ECEF of each;  (t, n) clocks in the middle [s]
    """
    t_ns = reference_ns[:: len(c.index)]
    # Errors of reports are told by middles of minutes; all reference times are equally far from theirs.
    middles_ns = t_ns // MINUTE_NS * MINUTE_NS + MINUTE_NS // 2
    nodes_s = (t_ns - middles_ns)[0] / gpstime.NS_PER_S + _STEP_S * np.array((-1.0, 0.0, 1.0))
    pos_m, _, _ = c.sample(middles_ns, nodes_s)
    axes = _axes(c, pos_m, ((middles_ns - c.epoch_ns) / gpstime.NS_PER_S)[:, None, None] + nodes_s[:, None])
    vel_mps = c.radius_m * c.latitude_rps * axes[..., 1, :] + c.node_rps * np.cross((0.0, 0.0, 1.0), pos_m)
    off_m, off_clock_m = np.zeros(pos_m.shape), np.zeros(pos_m.shape[:3])
    for error in errors:
        place, clock = error(middles_ns, nodes_s, pos_m, vel_mps)
        off_m, off_clock_m = off_m + place, off_clock_m + clock
    return axes, off_m, off_clock_m[:, 1] / LIGHT_MPS


def _axes(c: NominalConstellation, pos_m: F64, age_s: F64) -> F64:
    """Rows up, ahead and along the orbit's normal (..., 3, 3) of satellites at pos_m (..., 3), ECEF."""
    node = c.node_rad + c.node_rps * age_s
    level, steep = np.sin(c.inclination_rad), np.cos(c.inclination_rad)
    normal = np.stack((level * np.sin(node), -level * np.cos(node), np.full(node.shape, steep)), axis=-1)
    up = pos_m / c.radius_m
    return np.stack((up, np.cross(normal, up), normal), axis=-2)
