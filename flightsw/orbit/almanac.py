"""Where satellites are that no channel tracks: predictions for every satellite, brought forward to now.

The patent takes coordinates from the satellites tracked and is silent on all others. Two sources: the
receivers' almanac frames (250 m, 1 m/s) and, better, the report of every tracked satellite. Both are a
position and velocity at a known instant, extrapolated with the satellite's own acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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


NEVER_NS = -(1 << 62)

PROVEN_NS = 300 * 10**9
"""So long after it was in a fix, what a satellite reported stands against a report that contradicts it."""

_NEAR_M, _JERK_MPS3 = 100.0, 2e-4
"""How far a report may be from what the one before predicts: new ephemerides step by some metres, those of
satellites seldom uploaded by tens, and what the prediction leaves out grows by the third derivative, 1e-4
m/s^3 for navigation satellites."""


@dataclass(frozen=True, slots=True)
class Predictions:
    """A table over the satellite indices that receivers may track.

    pos_ecef_m, vel_ecef_mps   (3, ROWS) in the frame of instant t_ns (ROWS,)
    predicted, tracked, healthy   (ROWS,) bool; tracked: from a measurement, not from the almanac
    proven_ns                  (ROWS,) when a report of it last was in a fix that others agreed with
    """

    pos_ecef_m: F64
    vel_ecef_mps: F64
    t_ns: I64
    predicted: Bool
    tracked: Bool
    healthy: Bool
    proven_ns: I64


def no_predictions() -> Predictions:
    no = np.zeros(ROWS, bool)
    never = np.full(ROWS, NEVER_NS)
    return Predictions(np.zeros((3, ROWS)), np.zeros((3, ROWS)), np.zeros(ROWS, np.int64), no, no, no, never)


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


def flight_ns(m: Measurements, craft_m: F64 | None) -> I64:
    """(n,) flight times: from where satellites are to the craft (3,); where that is not known, by the
    pseudorange, which is wrong by the receiver's clock."""
    if craft_m is None:
        distance_m = m.pseudorange_m + m.clock_m
    else:
        away = m.pos_sv_m - craft_m[:, None]
        distance_m = np.sqrt(np.add.reduce(away * away))
    return (distance_m * (1e9 / LIGHT_MPS)).astype(np.int64)


def contradicted(table: Predictions, m: Measurements, sent_ns: I64, now_ns: int) -> tuple[Bool, Bool]:
    """(n,) measurements whose satellite reported something else before, which a fix has proven since, and
    which of them could be compared at all: a satellite moves 3.9 km in a second.

    sent_ns   (n,) when the signals were transmitted
    """
    sat = np.where(m.sat < ROWS, m.sat, 0)  # a number that no satellite has is never proven
    known = table.proven_ns[sat] > now_ns - PROVEN_NS
    dt_ns = sent_ns - table.t_ns[sat]
    expected = _moved(table.pos_ecef_m.take(sat, axis=1), table.vel_ecef_mps.take(sat, axis=1), dt_ns)
    away = m.pos_sv_m - expected
    limit_m = _NEAR_M + _JERK_MPS3 / 6 * np.abs(dt_ns * 1e-9) ** 3
    return known & (np.add.reduce(away * away) > limit_m**2), known


def proven(table: Predictions, sat: I64, t_ns: int) -> Predictions:
    """After a fix that others agreed with, made of these satellites."""
    proven_ns = table.proven_ns.copy()
    proven_ns[sat] = t_ns
    return replace(table, proven_ns=proven_ns)


def updated(
    table: Predictions, rows: AlmanacRows, m: Measurements, t_ns: int, sent_ns: I64 | None = None
) -> Predictions:
    """The table with this epoch's almanac frames and tracked satellites, which all have been judged: what
    stood before stands where there is none.

    sent_ns   (n,) when the signals measured were transmitted; by the pseudorange where it is not said
    """
    pos, vel, when = table.pos_ecef_m.copy(), table.vel_ecef_mps.copy(), table.t_ns.copy()
    current, tracked = table.predicted & (np.abs(t_ns - table.t_ns) < MAX_AGE_NS), table.tracked.copy()
    healthy = table.healthy.copy()

    if len(rows.sat):
        kept = rows.where(~(table.tracked[rows.sat] & (t_ns - table.t_ns[rows.sat] < TRACKED_AGE_NS)))
        pos[:, kept.sat], vel[:, kept.sat], when[kept.sat] = kept.pos_ecef_m, kept.vel_ecef_mps, t_ns
        current[kept.sat], tracked[kept.sat] = True, False
        healthy[rows.sat] = rows.healthy

    # A report is of the transmission instant.
    when[m.sat] = t_ns - flight_ns(m, None) if sent_ns is None else sent_ns
    pos[:, m.sat], vel[:, m.sat] = m.pos_sv_m, m.vel_sv_mps
    current[m.sat], tracked[m.sat] = True, True
    healthy[m.sat] = m.health == 0
    return Predictions(pos, vel, when, current, tracked, healthy, table.proven_ns)


def predicted(table: Predictions, t_ns: int) -> tuple[I64, F64]:
    """Satellites with a prediction (n,) by index, and where they are at t_ns, (3, n) ECEF of that instant.

    Second order with gravity and the rotating frame's own accelerations; third order left out, 0.1 m at 20 s.
    """
    (sat,) = table.predicted.nonzero()
    dt_ns = t_ns - table.t_ns[sat]
    return sat, _moved(table.pos_ecef_m.take(sat, axis=1), table.vel_ecef_mps.take(sat, axis=1), dt_ns)


def _moved(r: F64, v: F64, dt_ns: I64) -> F64:
    """Positions (3, n) after times (n,)."""
    dt_s = dt_ns.astype(np.float64) * 1e-9
    r2 = np.maximum(np.add.reduce(r * r), EQUATOR_M**2)  # of satellites that are not in the table: anywhere
    acceleration = r * (-MU_M3_S2 / (r2 * np.sqrt(r2)))
    acceleration[:2] += ROTATION_RPS**2 * r[:2] + _CORIOLIS_RPS * v[1::-1]
    return r + dt_s * (v + 0.5 * dt_s * acceleration)
