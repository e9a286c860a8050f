"""How a craft is turned: quaternion body from ECEF and rate relative to inertial space.

Quaternions are Hamilton, scalar first, passive: v_body = C(q) v_ecef. The orbital frame (LVLH) has z to
nadir, y along the negative orbit normal (starboard), x completing it (fore); turns from it are
yaw-pitch-roll, 3-2-1. Orbit plane and rates are those of inertial motion, written in ECEF axes.

Step 5 and block 4 of RU 2706636 C1: the attitude of the spacecraft in the Greenwich frame. This is the
true one; what the unit puts on the bus is as far off as `gnss_hil.emulator.attitude.determination` has it,
where that factor is on.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from math import radians

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.config import tables as scenario
from gnss_hil.emulator.earth.constants import ROTATION_RPS
from gnss_hil.emulator.numerics.rotations import dcm_321, quaternion_of_dcm, rate_321
from gnss_hil.emulator.orbits.dynamics import CraftState

Triple = tuple[float, float, float]

# A turn relative to the orbital frame at t: angles roll, pitch, yaw [rad], and their rates [rad/s].
Turning = Callable[[int], tuple[Triple, Triple]]

_STILL = (0.0, 0.0, 0.0)


def lvlh(state: CraftState) -> tuple[F64, F64]:
    """The orbital frame of a craft, at one instant or at q of them.

    returns  (..., 3, 3) rows x, y, z of the frame in ECEF axes; (..., 3) its rate relative to inertial space,
             in its own axes [rad/s]

    The frame turns about the orbit normal with h / r^2 and, where a force has a component a_h along the
    normal, about the radius with r a_h / h. Source: Gauss's equations, e.g. Battin, An Introduction to the
    Mathematics and Methods of Astrodynamics, 10.3 (local frame's rotation)
    """
    x, y, z = np.moveaxis(state.pos_ecef_m, -1, 0)
    vx, vy, vz = np.moveaxis(state.vel_ecef_mps, -1, 0)
    ax, ay, az = np.moveaxis(state.acc_ecef_mps2, -1, 0)
    w = ROTATION_RPS
    # Inertial acceleration and velocity from the relative ones: Coriolis, then centrifugal.
    ax, ay = ax - 2 * w * vy - w * w * x, ay + 2 * w * vx - w * w * y
    vx, vy = vx - w * y, vy + w * x
    hx, hy, hz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    r, h = np.sqrt(x * x + y * y + z * z), np.sqrt(hx * hx + hy * hy + hz * hz)
    zx, zy, zz = -x / r, -y / r, -z / r
    yx, yy, yz = -hx / h, -hy / h, -hz / h
    rows = (yy * zz - yz * zy, yz * zx - yx * zz, yx * zy - yy * zx), (yx, yy, yz), (zx, zy, zz)
    dcm = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    acc_normal = -(ax * yx + ay * yy + az * yz)
    return dcm, np.stack((np.zeros_like(r), -h / (r * r), -acc_normal * r / h), axis=-1)


class OrbitalAttitude:
    """Attitude given relative to the orbital frame: modes lvlh, offset and slew."""

    def __init__(self, turning: Turning):
        self._turning = turning

    def at(self, t_ns: int, state: CraftState) -> tuple[F64, F64]:
        """Quaternion body from ECEF (4,) and rate relative to inertial space, body axes (3,) [rad/s]."""
        return self._turned(*self._turn(t_ns), state)

    def over(self, t_ns: I64, state: CraftState) -> tuple[F64, F64]:
        """The same (q, 4) and (q, 3) at times (q,) with the craft's states (q, 3) there."""
        turns = [self._turn(t) for t in t_ns.tolist()]
        body_from_lvlh, own_rate = (np.stack(part) for part in zip(*turns, strict=True))
        return self._turned(body_from_lvlh, own_rate, state)

    def _turn(self, t_ns: int) -> tuple[F64, F64]:
        (roll, pitch, yaw), (roll_rate, pitch_rate, yaw_rate) = self._turning(t_ns)
        return dcm_321(roll, pitch, yaw), rate_321(roll, pitch, roll_rate, pitch_rate, yaw_rate)

    @staticmethod
    def _turned(body_from_lvlh: F64, own_rate: F64, state: CraftState) -> tuple[F64, F64]:
        lvlh_from_ecef, frame_rate = lvlh(state)
        rate = own_rate + (body_from_lvlh @ frame_rate[..., None])[..., 0]
        return quaternion_of_dcm(body_from_lvlh @ lvlh_from_ecef), rate


class InertialAttitude:
    """Attitude fixed in inertial space, given by that at the start."""

    def __init__(self, start_ns: int, body_from_start_ecef: F64):
        self._start_ns = start_ns
        self._dcm = body_from_start_ecef

    def at(self, t_ns: int, state: CraftState) -> tuple[F64, F64]:
        """Quaternion body from ECEF (4,) and rate relative to inertial space, body axes (3,) [rad/s]."""
        turned = ROTATION_RPS * ((t_ns - self._start_ns) / 1e9)
        # ECEF axes of t to those of the start: back by what the Earth has turned.
        start_from_now = dcm_321(0.0, 0.0, -turned)
        return quaternion_of_dcm(self._dcm @ start_from_now), np.zeros(3)

    def over(self, t_ns: I64, state: CraftState) -> tuple[F64, F64]:
        """The same (q, 4) and (q, 3) at times (q,)."""
        found = [self.at(t, state) for t in t_ns.tolist()]
        return np.stack([quaternion for quaternion, _ in found]), np.zeros((len(found), 3))


Attitude = OrbitalAttitude | InertialAttitude


def quintic(x: float) -> tuple[float, float]:
    """Smooth step 0 to 1 on [0, 1] and its derivative; first and second derivatives vanish at the ends."""
    return x * x * x * (10 + x * (6 * x - 15)), 30 * x * x * (1 - x) * (1 - x)


def steady(angles: Triple) -> Turning:
    return lambda t_ns: (angles, _STILL)


def profile(turns: Sequence[scenario.Turn], start_ns: int) -> Turning:
    """Angles held before the first turn and after the last, joined by quintics between."""
    times_s = [turn.t_s for turn in turns]
    angles = [_angles(turn) for turn in turns]

    def turning(t_ns):
        t_s = (t_ns - start_ns) / 1e9
        after = bisect_right(times_s, t_s)
        if after in (0, len(times_s)):
            return angles[min(after, len(times_s) - 1)], _STILL
        span_s = times_s[after] - times_s[after - 1]
        part, slope = quintic((t_s - times_s[after - 1]) / span_s)
        before = angles[after - 1]
        change = [end - start for start, end in zip(before, angles[after], strict=True)]
        now = _triple(start + part * by for start, by in zip(before, change, strict=True))
        return now, _triple(slope / span_s * by for by in change)

    return turning


def _triple(values: Iterable[float]) -> Triple:
    first, second, third = values
    return first, second, third


def _angles(turn: scenario.Turn | scenario.Attitude) -> Triple:
    return radians(turn.roll_deg), radians(turn.pitch_deg), radians(turn.yaw_deg)


def _inertial(attitude: scenario.Attitude, start_ns: int, state: CraftState) -> Attitude:
    return InertialAttitude(start_ns, dcm_321(*_angles(attitude)) @ lvlh(state)[0])


# Mode -> maker from the scenario's table, start and the craft's state at the start.
MODES: dict[str, Callable[[scenario.Attitude, int, CraftState], Attitude]] = {
    "lvlh": lambda attitude, start_ns, state: OrbitalAttitude(steady(_STILL)),
    "offset": lambda attitude, start_ns, state: OrbitalAttitude(steady(_angles(attitude))),
    "inertial": _inertial,
    "slew": lambda attitude, start_ns, state: OrbitalAttitude(profile(attitude.profile, start_ns)),
}


def build_attitude(attitude: scenario.Attitude, start_ns: int, state: CraftState) -> Attitude:
    """The attitude a scenario describes; `state` is the craft's at start_ns."""
    return MODES[attitude.mode](attitude, start_ns, state)
