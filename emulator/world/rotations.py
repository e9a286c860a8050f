"""Rotations of a rigid body: matrices, quaternions and 3-2-1 angles.

Passive throughout: C turns coordinates, v_body = C v_reference. Quaternions are Hamilton's, scalar first.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
