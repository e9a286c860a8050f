"""How a craft is turned: quaternion body from ECEF and rate relative to inertial space.

Quaternions are Hamilton, scalar first, passive: v_body = C(q) v_ecef. The orbital frame (LVLH) has
z to nadir, y along the negative orbit normal (starboard), x completing it (fore); turns from it are
yaw-pitch-roll, 3-2-1. Orbit plane and rates are those of inertial motion, written in ECEF axes.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from emulator import scenario
from emulator.world.earth import ROTATION_RPS
from emulator.world.orbit import CraftState

Array = NDArray[np.float64]

# A turn relative to the orbital frame at t: (angles (3,) roll pitch yaw [rad], their rates (3,) [rad/s]).
Turning = Callable[[int], tuple[Array, Array]]


def lvlh(state: CraftState) -> tuple[Array, Array]:
    """The orbital frame of a craft.

    returns  (3, 3) rows x, y, z of the frame in ECEF axes; (3,) its rate relative to inertial space,
             in its own axes [rad/s]

    The frame turns about the orbit normal with h / r^2 and, where a force has a component a_h along
    the normal, about the radius with r a_h / h. Source: Gauss's equations, e.g. Battin, An Introduction
    to the Mathematics and Methods of Astrodynamics, 10.3 (local frame's rotation)
    """
    (x, y, z), (vx, vy, vz) = state.pos_ecef_m.tolist(), state.vel_ecef_mps.tolist()
    ax, ay, az = state.acc_ecef_mps2.tolist()
    w = ROTATION_RPS
    # Inertial acceleration and velocity from the relative ones: Coriolis, then centrifugal.
    ax, ay = ax - 2 * w * vy - w * w * x, ay + 2 * w * vx - w * w * y
    vx, vy = vx - w * y, vy + w * x
    hx, hy, hz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    r, h = sqrt(x * x + y * y + z * z), sqrt(hx * hx + hy * hy + hz * hz)
    zx, zy, zz = -x / r, -y / r, -z / r
    yx, yy, yz = -hx / h, -hy / h, -hz / h
    dcm = np.array(
        ((yy * zz - yz * zy, yz * zx - yx * zz, yx * zy - yy * zx), (yx, yy, yz), (zx, zy, zz)),
    )
    acc_normal = -(ax * yx + ay * yy + az * yz)
    return dcm, np.array((0.0, -h / (r * r), -acc_normal * r / h))


def dcm_321(roll: float, pitch: float, yaw: float) -> Array:
    """(3, 3) matrix of the turn yaw about z, then pitch about y, then roll about x [rad]."""
    cr, sr, cp, sp, cy, sy = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    return np.array(
        (
            (cp * cy, cp * sy, -sp),
            (sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp),
            (cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp),
        )
    )


def rate_321(roll: float, pitch: float, roll_rate: float, pitch_rate: float, yaw_rate: float) -> Array:
    """(3,) body rate [rad/s] of 3-2-1 angles [rad] and their rates.

    Source: Wertz (ed.), Spacecraft Attitude Determination and Control, appendix E, 3-2-1 sequence
    """
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    return np.array(
        (
            roll_rate - yaw_rate * sp,
            pitch_rate * cr + yaw_rate * sr * cp,
            yaw_rate * cr * cp - pitch_rate * sr,
        )
    )


def quaternion_of_dcm(dcm: Array) -> Array:
    """(4,) unit quaternion, scalar first and not negative, of a passive rotation matrix.

    Source: Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1, 1978
    """
    (a, b, c), (d, e, f), (g, h, i) = dcm.tolist()
    squares = (1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i)
    largest = squares.index(max(squares))
    rows = (
        (squares[0], f - h, g - c, b - d),
        (f - h, squares[1], b + d, g + c),
        (g - c, b + d, squares[2], f + h),
        (b - d, g + c, f + h, squares[3]),
    )
    quaternion = np.array(rows[largest]) / (2 * sqrt(squares[largest]))
    return -quaternion if quaternion[0] < 0 else quaternion


def dcm_of_quaternion(quaternion: Array) -> Array:
    """(3, 3) passive rotation matrix C(q) of a unit quaternion (4,), scalar first."""
    w, x, y, z = quaternion.tolist()
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
            (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
            (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
        )
    )


class OrbitalAttitude:
    """Attitude given relative to the orbital frame: modes lvlh, offset and slew."""

    def __init__(self, turning: Turning):
        self._turning = turning

    def at(self, t_ns: int, state: CraftState) -> tuple[Array, Array]:
        """Quaternion body from ECEF (4,) and rate relative to inertial space, body axes (3,) [rad/s]."""
        (roll, pitch, yaw), (roll_rate, pitch_rate, yaw_rate) = self._turning(t_ns)
        lvlh_from_ecef, frame_rate = lvlh(state)
        body_from_lvlh = dcm_321(roll, pitch, yaw)
        rate = rate_321(roll, pitch, roll_rate, pitch_rate, yaw_rate) + body_from_lvlh @ frame_rate
        return quaternion_of_dcm(body_from_lvlh @ lvlh_from_ecef), rate


class InertialAttitude:
    """Attitude fixed in inertial space, given by that at the start."""

    def __init__(self, start_ns: int, body_from_start_ecef: Array):
        self._start_ns = start_ns
        self._dcm = body_from_start_ecef

    def at(self, t_ns: int, state: CraftState) -> tuple[Array, Array]:
        """Quaternion body from ECEF (4,) and rate relative to inertial space, body axes (3,) [rad/s]."""
        turned = ROTATION_RPS * ((t_ns - self._start_ns) / 1e9)
        # ECEF axes of t to those of the start: back by what the Earth has turned.
        start_from_now = dcm_321(0.0, 0.0, -turned)
        return quaternion_of_dcm(self._dcm @ start_from_now), np.zeros(3)


Attitude = OrbitalAttitude | InertialAttitude


def quintic(x: float) -> tuple[float, float]:
    """Smooth step 0 to 1 on [0, 1] and its derivative; first and second derivatives vanish at the ends."""
    return x * x * x * (10 + x * (6 * x - 15)), 30 * x * x * (1 - x) * (1 - x)


def steady(angles: Array) -> Turning:
    still = np.zeros(3)
    return lambda t_ns: (angles, still)


def profile(turns: list[scenario.Turn], start_ns: int) -> Turning:
    """Angles held before the first turn and after the last, joined by quintics between."""
    times_s = np.array([turn.t_s for turn in turns])
    angles = np.deg2rad([(turn.roll_deg, turn.pitch_deg, turn.yaw_deg) for turn in turns])
    still = np.zeros(3)

    def turning(t_ns):
        t_s = (t_ns - start_ns) / 1e9
        after = int(np.searchsorted(times_s, t_s, side="right"))
        if after in (0, len(times_s)):
            return angles[min(after, len(times_s) - 1)], still
        span_s = times_s[after] - times_s[after - 1]
        part, slope = quintic((t_s - times_s[after - 1]) / span_s)
        change = angles[after] - angles[after - 1]
        return angles[after - 1] + part * change, slope / span_s * change

    return turning


def _offset(attitude: scenario.Attitude) -> Array:
    return np.deg2rad([attitude.roll_deg, attitude.pitch_deg, attitude.yaw_deg])


def _inertial(attitude: scenario.Attitude, start_ns: int, state: CraftState) -> Attitude:
    return InertialAttitude(start_ns, dcm_321(*_offset(attitude)) @ lvlh(state)[0])


# Mode -> maker from the scenario's table, start and the craft's state at the start.
MODES: dict[str, Callable[[scenario.Attitude, int, CraftState], Attitude]] = {
    "lvlh": lambda attitude, start_ns, state: OrbitalAttitude(steady(np.zeros(3))),
    "offset": lambda attitude, start_ns, state: OrbitalAttitude(steady(_offset(attitude))),
    "inertial": _inertial,
    "slew": lambda attitude, start_ns, state: OrbitalAttitude(profile(attitude.profile, start_ns)),
}


def build_attitude(attitude: scenario.Attitude, start_ns: int, state: CraftState) -> Attitude:
    """The attitude a scenario describes; `state` is the craft's at start_ns."""
    return MODES[attitude.mode](attitude, start_ns, state)
