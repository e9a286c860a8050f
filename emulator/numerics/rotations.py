"""Rotations of a rigid body: matrices, quaternions and 3-2-1 angles.

Passive throughout: C turns coordinates, v_body = C v_reference. Quaternions are Hamilton's, scalar first.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from gnss_hil.dbc.common.arrays import F64


def dcm_321(roll: float, pitch: float, yaw: float) -> F64:
    """(3, 3) matrix of the turn yaw about z, then pitch about y, then roll about x [rad]."""
    cr, sr, cp, sp, cy, sy = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    return np.array(
        (
            (cp * cy, cp * sy, -sp),
            (sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp),
            (cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp),
        )
    )


def rate_321(roll: float, pitch: float, roll_rate: float, pitch_rate: float, yaw_rate: float) -> F64:
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


def quaternion_of_dcm(dcm: F64) -> F64:
    """Unit quaternions (..., 4), scalar first and not negative, of passive rotation matrices (..., 3, 3).

    Source: Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1, 1978
    """
    a, b, c, d, e, f, g, h, i = (dcm[..., row, column] for row in range(3) for column in range(3))
    squares = np.stack((1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i), axis=-1)
    rows = (
        (squares[..., 0], f - h, g - c, b - d),
        (f - h, squares[..., 1], b + d, g + c),
        (g - c, b + d, squares[..., 2], f + h),
        (b - d, g + c, f + h, squares[..., 3]),
    )
    products = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    largest = squares.argmax(axis=-1)[..., None]
    chosen = np.take_along_axis(products, largest[..., None], axis=-2)[..., 0, :]
    quaternion = chosen / (2 * np.sqrt(np.take_along_axis(squares, largest, axis=-1)))
    return np.where(quaternion[..., :1] < 0, -quaternion, quaternion)


def dcm_of_quaternion(quaternion: F64) -> F64:
    """(3, 3) passive rotation matrix C(q) of a unit quaternion (4,), scalar first."""
    return np.array(_rows(*quaternion.tolist()))


def dcm_of_quaternions(quaternions: F64) -> F64:
    """(n, 3, 3) matrices of unit quaternions (n, 4)."""
    return np.stack([np.stack(row, axis=-1) for row in _rows(*quaternions.T)], axis=1)


def _rows(w, x, y, z):
    """Rows of C(q); numbers or arrays."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )


def product(a: F64, b: F64) -> F64:
    """Hamilton product of quaternions (..., 4). Of passive ones: the turn a and then the turn b."""
    a0, a1, a2, a3 = np.moveaxis(a, -1, 0)
    b0, b1, b2, b3 = np.moveaxis(b, -1, 0)
    return np.stack(
        (
            a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
            a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
            a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
            a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
        ),
        axis=-1,
    )
