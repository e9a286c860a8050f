"""What a craft sees of the sky: directions, angles off boresight, the Earth in the way.

Satellites are taken where they were at transmission; the antennas share the directions seen from the
centre of mass (a lever arm of metres turns them by 1e-7 rad).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.emulator.earth.constants import EQUATORIAL_RADIUS_M, LIGHT_MPS, POLAR_RADIUS_M
from gnss_hil.emulator.signal.geometry import Antennas, Array, Motion, angle_rad, norm

_TO_SPHERE = np.array((1.0, 1.0, EQUATORIAL_RADIUS_M / POLAR_RADIUS_M))


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A craft's view of n satellites with m antennas.

    distance_m      (n,) from the centre of mass
    sin_elevation   (n,) sine of the height above the plane normal to the radius
    ray_height_m    (n,) least height of the ray above the ellipsoid; inf where it only rises or only falls
    angle_rad       (m, n) off boresight
    los_ecef        (n, 3) unit vectors from the centre of mass
    """

    distance_m: Array
    sin_elevation: Array
    ray_height_m: Array
    angle_rad: Array
    los_ecef: Array


def look(satellites: Motion, pos_ecef_m: Array, antennas: Antennas) -> View:
    """View from a craft at pos_ecef_m (3,) of satellites (n, 3), both at the instant of reception."""
    towards = satellites.pos_m - pos_ecef_m
    towards -= (norm(towards) / LIGHT_MPS)[:, None] * satellites.vel_mps
    distance_m = norm(towards)
    los = towards / distance_m[:, None]
    up = pos_ecef_m / np.sqrt(pos_ecef_m @ pos_ecef_m)
    height_m = ray_height_m(pos_ecef_m, towards)
    return View(distance_m, los @ up, height_m, angles_rad(antennas.boresight, los), los)


def angles_rad(boresight: Array, los: Array) -> Array:
    """Angles (m, n) [rad] between unit vectors (m, 3) and (n, 3), each with each."""
    return angle_rad(boresight[:, None], los)


def ray_height_m(pos_ecef_m: Array, towards_m: Array) -> Array:
    """Least height (n,) [m] above the WGS-84 ellipsoid of the way from a craft to satellites.

    pos_ecef_m   (3,) the craft
    towards_m    (n, 3) from the craft to the satellites
    returns      inf where the lowest point of the line is not between the two
    Stretched along z the ellipsoid is a sphere, in which the lowest point is found; the height at the
    surface is exact, at 100 km wrong by 0.4 km at most.
    """
    start = pos_ecef_m * _TO_SPHERE
    way = towards_m * _TO_SPHERE
    length_m = norm(way)
    way /= length_m[:, None]
    lowest_at_m = -(way @ start)
    lowest_m = norm(start + lowest_at_m[:, None] * way) - EQUATORIAL_RADIUS_M
    return np.where((lowest_at_m > 0) & (lowest_at_m < length_m), lowest_m, np.inf)


def in_sight(view: View, ray_height_m: float) -> NDArray[np.bool_]:
    """(n,) whether the ray passes the Earth at ray_height_m or higher."""
    return view.ray_height_m >= ray_height_m
