"""Blocks 5 to 7 of RU 2706636 C1: boresights, angles of satellites to them, the Earth in the way.

Boresights and directions are in the Greenwich frame (ECEF).
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.flightsw.attitude.attitude import Attitude
from gnss_hil.flightsw.orbit.earth import EQUATOR_M, FLATTENING

_STRETCH = np.array([1.0, 1.0, 1 / (1 - FLATTENING)])


def boresights_ecef(attitude: Attitude, boresight_body: F64) -> F64:
    """l_ecef = A^T l, (m, 3) unit vectors; boresight_body (m, 3) is the setter, block 6: the vehicle file."""
    return boresight_body @ attitude.dcm_body_from_ecef


def directions(pos_sv_m: F64, position_m: F64) -> tuple[F64, F64]:
    """u = (X_i - X) / |X_i - X|, (3, n), and |X_i - X|, (n,), from pos_sv_m (3, n), position_m (3,), ECEF."""
    away = pos_sv_m - position_m[:, None]
    distance = np.sqrt(np.add.reduce(away * away))
    return away / distance, distance


def angles_rad(los_ecef: F64, boresight_ecef: F64) -> F64:
    """Angles (m, n) between unit directions (3, n) and boresights (m, 3).

    theta = 2 atan2(|u - l|, |u + l|), exact to rounding at any angle.
    Source: Kahan, How Futile are Mindless Assessments of Roundoff, section 12
    """
    axis = boresight_ecef[:, :, None]
    minus, plus = los_ecef - axis, los_ecef + axis
    return 2 * np.arctan2(
        np.sqrt(np.add.reduce(minus * minus, axis=1)), np.sqrt(np.add.reduce(plus * plus, axis=1))
    )


def clear_of_earth(
    los_ecef: F64,
    distance_m: F64,
    position_m: F64,
    ray_height_m: float,
) -> Bool:
    """(n,) whether rays (3, n) to satellites stay `ray_height_m` above the WGS-84 ellipsoid.

    Stretching z by 1 / (1 - f) makes the ellipsoid a sphere and leaves rays straight; the height is then
    right to its f-th part. A ray is blocked where its lowest point lies between craft and satellite.
    """
    origin = position_m * _STRETCH
    ray = los_ecef * _STRETCH[:, None]
    squared = np.add.reduce(ray * ray)
    down = -(origin @ ray)
    lowest = down / squared
    height2 = origin @ origin - lowest * down
    between = (lowest > 0) & (lowest < distance_m)
    return ~(between & (height2 < (EQUATOR_M + ray_height_m) ** 2))
