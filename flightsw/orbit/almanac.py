"""Where satellites are that no channel tracks: predictions for every satellite, brought forward to now.

The patent takes coordinates from the satellites tracked and is silent on all others. Two sources: the
receivers' almanac frames (250 m, 1 m/s) and, better, the report of every tracked satellite. Both are a
position and velocity at a known instant, extrapolated with the satellite's own acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.dbc.common.systems import column
from gnss_hil.flightsw.orbit.earth import EQUATOR_M, LIGHT_MPS, MU_M3_S2, ROTATION_RPS
from gnss_hil.flightsw.records.epoch import AlmanacRows, Measurements

MAX_AGE_NS = 900 * 10**9
"""A prediction older than this is forgotten: the cubic term left out has then grown to 10 km, 0.03 deg."""

_TRACKABLE: Bool = np.repeat(column(lambda system: system.tracked, False), NUMBERS)
_TRACKABLE[::NUMBERS] = False
"""(SATELLITES,) whether an index is a satellite of a system that receivers track."""

ROWS = int(_TRACKABLE.nonzero()[0][-1]) + 1
"""Indices up to the last such satellite."""

_TURNING_RPS = ROTATION_RPS * np.array([[1.0], [-1.0]])
"""Minus the rotation as a vector product: of y and x (2, n), its x and y."""

_CORIOLIS_RPS = 2 * _TURNING_RPS

TRACKED_AGE_NS = 120 * 10**9
"""For this long the report of a satellite once tracked stands against almanac frames: it stays better."""


@dataclass(frozen=True, slots=True)
class Predictions:
    """A table over the satellite indices that receivers may track.

    pos_ecef_m, vel_ecef_mps   (3, ROWS) in the frame of instant t_ns (ROWS,)
    predicted, tracked, healthy   (ROWS,) bool; tracked: from a measurement, not from the almanac
    """

    pos_ecef_m: F64
    vel_ecef_mps: F64
    t_ns: I64
    predicted: Bool
    tracked: Bool
    healthy: Bool


def no_predictions() -> Predictions:
    no = np.zeros(ROWS, bool)
    return Predictions(np.zeros((3, ROWS)), np.zeros((3, ROWS)), np.zeros(ROWS, np.int64), no, no, no)


def plausible(sat: I64, pos_ecef_m: F64, vel_ecef_mps: F64) -> Bool:
    """(n,) satellites that receivers can track, outside the Earth and bound to it; pos, vel (3, n), any
    instant."""
    r2 = np.add.reduce(pos_ecef_m * pos_ecef_m)
    across, along = vel_ecef_mps[:2] - _TURNING_RPS * pos_ecef_m[1::-1], vel_ecef_mps[2]
    inertial2 = np.add.reduce(across * across) + along * along
    return _TRACKABLE[sat] & (r2 > EQUATOR_M**2) & (inertial2 * inertial2 * r2 < (2 * MU_M3_S2) ** 2)


def orbits(rows: AlmanacRows, m: Measurements) -> tuple[AlmanacRows, Bool]:
    """The almanac frames that describe an orbit, and (n,) which measurements do: judged together."""
    bound = plausible(
        np.concatenate((m.sat, rows.sat)),
        np.concatenate((m.pos_sv_m, rows.pos_ecef_m), axis=1),
        np.concatenate((m.vel_sv_mps, rows.vel_ecef_mps), axis=1),
    )
    return rows.where(bound[len(m) :]), bound[: len(m)]


def updated(table: Predictions, rows: AlmanacRows, m: Measurements, t_ns: int) -> Predictions:
    """The table with this epoch's almanac frames and tracked satellites, which all have been judged: what
    stood before stands where there is none."""
    pos, vel, when = table.pos_ecef_m.copy(), table.vel_ecef_mps.copy(), table.t_ns.copy()
    current, tracked = table.predicted & (np.abs(t_ns - table.t_ns) < MAX_AGE_NS), table.tracked.copy()
    healthy = table.healthy.copy()

    if len(rows.sat):
        kept = rows.where(~(table.tracked[rows.sat] & (t_ns - table.t_ns[rows.sat] < TRACKED_AGE_NS)))
        pos[:, kept.sat], vel[:, kept.sat], when[kept.sat] = kept.pos_ecef_m, kept.vel_ecef_mps, t_ns
        current[kept.sat], tracked[kept.sat] = True, False
        healthy[rows.sat] = rows.healthy

    # A report is of the transmission instant; the pseudorange gives it well enough here (1 ms: 4 m).
    flight_ns = ((m.pseudorange_m + m.clock_m) * (1e9 / LIGHT_MPS)).astype(np.int64)
    pos[:, m.sat], vel[:, m.sat], when[m.sat] = m.pos_sv_m, m.vel_sv_mps, t_ns - flight_ns
    current[m.sat], tracked[m.sat] = True, True
    healthy[m.sat] = m.health == 0
    return Predictions(pos, vel, when, current, tracked, healthy)


def predicted(table: Predictions, t_ns: int) -> tuple[I64, F64]:
    """Satellites with a prediction (n,) by index, and where they are at t_ns, (3, n) ECEF of that instant.

    Second order with gravity and the rotating frame's own accelerations; third order left out, 0.1 m at 20 s.
    """
    (sat,) = table.predicted.nonzero()
    r, v = table.pos_ecef_m.take(sat, axis=1), table.vel_ecef_mps.take(sat, axis=1)
    dt = (t_ns - table.t_ns[sat]) * 1e-9
    r2 = np.add.reduce(r * r)
    acceleration = r * (-MU_M3_S2 / (r2 * np.sqrt(r2)))
    acceleration[:2] += ROTATION_RPS**2 * r[:2] + _CORIOLIS_RPS * v[1::-1]
    return sat, r + dt * (v + 0.5 * dt * acceleration)
