"""Attitude of the body in the Greenwich frame: what block 4 of RU 2706636 C1 delivers, ready for use.

The rule for stale attitude: an epoch without an attitude report uses the last one, turned on by its rates,
for at most `hold` epochs, and says how far it is known; after that there is no attitude, hence neither a fix
(lever arms cannot be reduced) nor a new assignment. A fix without lever arms would be metres wrong without
notice. A report that the craft cannot have turned to since the last one is none; nor is one that has not gone
along with the rates reported beside it, as the same one again and again has not. When the last one may be
held no longer it is believed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import acos, cos, sin, sqrt

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.orbit.earth import ROTATION_RPS
from gnss_hil.flightsw.records.epoch import AttitudeReport

HELD_RPS = 0.0035
"""1 sigma of how much faster a craft may turn than it last said: 0.2 deg/s, a slow slew (modelled)."""

NOT_TURNED_RAD = 0.02
"""What a report may be off from the last one turned on, beside the change of its rate: noise of the sensors,
and what their rates leave out."""

FOLLOWED_S = 30.0
"""Reports are followed by their rates for so long, then anew: rates that are off by 0.02 deg/s pass, one
attitude again and again in a low orbit, which turns by 0.06 deg in a second, does not."""

_EARTH_RPS = np.array([0.0, 0.0, ROTATION_RPS])


@dataclass(frozen=True, slots=True)
class Attitude:
    """Attitude at t_ns, reported `age` epochs ago.

    dcm_body_from_ecef   (3, 3)
    rate_body_rps        (3,) relative to inertial space, body axes
    followed   an earlier report, by the rates since
    sigma_rad, rate_sigma_rps   1 sigma about each axis of what has come to it since it was reported
    """

    dcm_body_from_ecef: F64
    rate_body_rps: F64
    t_ns: int
    age: int
    followed: Followed
    sigma_rad: float = 0.0
    rate_sigma_rps: float = 0.0


@dataclass(frozen=True, slots=True)
class Followed:
    """A report of `begun_ns`, turned on by all rates that were reported since.

    dcm_body_from_ecef   (3, 3)
    slack_rad            by how much changes of the rates leave it open
    """

    dcm_body_from_ecef: F64
    begun_ns: int
    slack_rad: float = 0.0


def dcm_from_quaternion(q: F64) -> F64:
    """C (3, 3) of a unit quaternion (4,), scalar first, Hamilton, passive: v_body = C v_ecef.

    Source: Kuipers, Quaternions and Rotation Sequences, 7.7 (frame rotation)
    """
    w, x, y, z = q.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def turn(rate_rps: F64, dt_s: float) -> F64:
    """DCM (3, 3) from axes before to axes after turning at a constant rate (3,) for dt_s, exactly."""
    half = 0.5 * dt_s * sqrt(rate_rps @ rate_rps)
    axis = rate_rps * (0.5 * dt_s * (sin(half) / half if half else 1.0))
    return dcm_from_quaternion(np.array([cos(half), *axis.tolist()]))


def attitude_now(
    report: AttitudeReport | None, last: Attitude | None, t_ns: int, hold: int
) -> Attitude | None:
    """This epoch's attitude from its report, else from the last one while it may be held, else None."""
    may_hold = last is not None and last.age < hold
    if report is None:
        return _turned_on(last, t_ns) if last is not None and may_hold else None
    dcm = dcm_from_quaternion(report.quaternion_body_from_ecef)
    followed = Followed(dcm, t_ns)
    if last is not None and may_hold:
        dt_s = (t_ns - last.t_ns) * 1e-9
        faster_rps = report.rate_body_rps - last.rate_body_rps
        turning = _turning(last.rate_body_rps + 0.5 * faster_rps, dt_s)
        slack_rad = sqrt(faster_rps @ faster_rps) * dt_s
        if _angle_rad(_turned(last.dcm_body_from_ecef, turning), dcm) > NOT_TURNED_RAD + slack_rad:
            return _turned_on(last, t_ns)
        gone = _gone_on(last.followed, turning, slack_rad)
        if _angle_rad(gone.dcm_body_from_ecef, dcm) > NOT_TURNED_RAD + gone.slack_rad:
            # By its rates: what comes to agree with them again is believed at once.
            return replace(_turned_on(last, t_ns), dcm_body_from_ecef=gone.dcm_body_from_ecef, followed=gone)
        followed = gone if t_ns - gone.begun_ns < FOLLOWED_S * 1e9 else followed
    return Attitude(dcm, report.rate_body_rps, t_ns, 0, followed)


_Turning = tuple[F64, F64]
"""Of the body, and of the Earth backwards: (3, 3) each."""


def _turning(rate_rps: F64, dt_s: float) -> _Turning:
    return turn(rate_rps, dt_s), turn(_EARTH_RPS, dt_s).T


def _turned(dcm: F64, turning: _Turning) -> F64:
    body, earth = turning
    return body @ dcm @ earth


def _angle_rad(one: F64, other: F64) -> float:
    """Between two attitudes (3, 3)."""
    cosine = (float(np.add.reduce(one * other, axis=None)) - 1) / 2
    return acos(min(max(cosine, -1.0), 1.0))


def _gone_on(before: Followed, turning: _Turning, slack_rad: float) -> Followed:
    """What is followed, turned on with the body."""
    return Followed(
        _turned(before.dcm_body_from_ecef, turning), before.begun_ns, before.slack_rad + slack_rad
    )


def _turned_on(last: Attitude, t_ns: int) -> Attitude:
    """At t_ns, after turning at the last rate."""
    dt_s = (t_ns - last.t_ns) * 1e-9
    turning = _turning(last.rate_body_rps, dt_s)
    dcm, followed = _turned(last.dcm_body_from_ecef, turning), _gone_on(last.followed, turning, 0.0)
    sigma_rad = last.sigma_rad + HELD_RPS * abs(dt_s)
    return Attitude(dcm, last.rate_body_rps, t_ns, last.age + 1, followed, sigma_rad, HELD_RPS)


def levers_ecef(attitude: Attitude, lever_arm_body_m: F64) -> tuple[F64, F64]:
    """Antennas relative to the centre of mass in ECEF: positions and velocities, (m, 3) each."""
    dcm = attitude.dcm_body_from_ecef
    wx, wy, wz = (attitude.rate_body_rps - dcm @ _EARTH_RPS).tolist()
    cross_transposed = np.array([[0.0, wz, -wy], [-wz, 0.0, wx], [wy, -wx, 0.0]])
    return lever_arm_body_m @ dcm, lever_arm_body_m @ (cross_transposed @ dcm)
