"""What a craft sees of the sky: directions, angles off boresight, the Earth in the way.

Satellites are taken where they were at transmission; the antennas share the directions seen from the
centre of mass (a lever arm of metres turns them by 1e-7 rad).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.earth.constants import EQUATORIAL_RADIUS_M, LIGHT_MPS, POLAR_RADIUS_M
from gnss_hil.emulator.signal.geometry import Motion, angle_rad, norm

_TO_SPHERE = np.array((1.0, 1.0, EQUATORIAL_RADIUS_M / POLAR_RADIUS_M))


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A craft's view of n satellites with m antennas, at one instant or several (...).

    distance_m      (..., n) from the centre of mass
    sin_elevation   (..., n) sine of the height above the plane normal to the radius
    ray_height_m    (..., n) least height of the ray above the ellipsoid; inf where it only rises or only
                    falls
    angle_rad       (..., m, n) off boresight
    los_ecef        (..., n, 3) unit vectors from the centre of mass
    """

    distance_m: F64
    sin_elevation: F64
    ray_height_m: F64
    angle_rad: F64
    los_ecef: F64


def look(satellites: Motion, pos_ecef_m: F64, boresight: F64, least_height_m: float = -np.inf) -> View:
    """View of satellites (..., n, 3) from a craft at pos_ecef_m (..., 3) with antennas whose axes are
    boresight (..., m, 3), all at the instant of reception.

    least_height_m  angles are given of satellites whose rays pass the Earth as high or higher; inf of others
    """
    towards = satellites.pos_m - pos_ecef_m[..., None, :]
    towards -= (norm(towards) / LIGHT_MPS)[..., None] * satellites.vel_mps
    distance_m = norm(towards)
    los = towards / distance_m[..., None]
    up = pos_ecef_m / norm(pos_ecef_m)[..., None]
    height_m = ray_height_m(pos_ecef_m, towards)
    sin_elevation = (los @ up[..., None])[..., 0]
    angle = np.full((*boresight.shape[:-1], los.shape[-2]), np.inf)
    *instant, row = np.nonzero(height_m >= least_height_m)
    axes = boresight[tuple(instant)]
    angle[(*instant, slice(None), row)] = _of_pairs(axes, los[(*instant, row)])
    return View(distance_m, sin_elevation, height_m, angle, los)


def _of_pairs(boresight: F64, los: F64) -> F64:
    """Angles (s, m) or, of one instant, (m, s) [rad] between axes (s, m, 3) or (m, 3) and vectors (s, 3)."""
    if boresight.ndim == 2:
        return angles_rad(boresight, los)
    return angle_rad(boresight, los[:, None])


def angles_rad(boresight: F64, los: F64) -> F64:
    """Angles (..., m, n) [rad] between unit vectors (..., m, 3) and (..., n, 3), each with each."""
    return angle_rad(boresight[..., :, None, :], los[..., None, :, :])


def ray_height_m(pos_ecef_m: F64, towards_m: F64) -> F64:
    """Least height (..., n) [m] above the WGS-84 ellipsoid of the way from a craft to satellites.

    pos_ecef_m   (..., 3) the craft
    towards_m    (..., n, 3) from the craft to the satellites
    returns      inf where the lowest point of the line is not between the two
    Stretched along z the ellipsoid is a sphere, in which the lowest point is found; the height at the
    surface is exact, at 100 km wrong by 0.4 km at most.
    """
    start = pos_ecef_m * _TO_SPHERE
    way = towards_m * _TO_SPHERE
    length_m = norm(way)
    way /= length_m[..., None]
    lowest_at_m = -(way @ start[..., None])[..., 0]
    lowest_m = norm(start[..., None, :] + lowest_at_m[..., None] * way) - EQUATORIAL_RADIUS_M
    return np.where((lowest_at_m > 0) & (lowest_at_m < length_m), lowest_m, np.inf)
