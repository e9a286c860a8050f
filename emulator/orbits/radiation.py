"""Sunlight on a craft: how much of the Sun it sees past the Earth, and the pressure at its distance.

Source: Montenbruck & Gill, Satellite Orbits, 3.4
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.earth.constants import EQUATORIAL_RADIUS_M
from gnss_hil.emulator.earth.sun_moon import AU_M

PRESSURE_AT_AU_NPM2 = 4.56e-6
"""Of sunlight that is absorbed, at one astronomical unit. Montenbruck & Gill, 3.4 (1367 W/m^2 over c)."""

SUN_RADIUS_M = 696e6
"""Montenbruck & Gill, 3.4.2."""


def sunlit_fraction(pos_m: F64, sun_m: F64) -> F64:
    """Visible part of the Sun's disk, 0 to 1, (k,), from positions (k, 3), with the Sun at (k, 3) [m].

    The overlap of two disks in the sky; either may be the larger one. The Earth is a sphere as wide as its
    equator: in low orbits the true edge of its shadow is up to 21 km, 3 s, inside of that.
    Source: Montenbruck & Gill, 3.4.2 (eqs. 3.85 to 3.94)
    """
    to_sun_m = sun_m - pos_m
    distance_m, r_m = np.linalg.norm(to_sun_m, axis=1), np.linalg.norm(pos_m, axis=1)
    sun_rad = np.arcsin(SUN_RADIUS_M / distance_m)
    earth_rad = np.arcsin(np.minimum(EQUATORIAL_RADIUS_M / r_m, 1.0))
    apart_rad = np.arctan2(
        np.linalg.norm(np.cross(to_sun_m, pos_m), axis=1), -np.einsum("ij,ij->i", to_sun_m, pos_m)
    )
    lit = np.ones(len(pos_m))
    covered = apart_rad <= np.abs(earth_rad - sun_rad)
    lit[covered] = 1 - np.minimum(earth_rad / sun_rad, 1.0)[covered] ** 2
    partly = (apart_rad < earth_rad + sun_rad) & ~covered
    if partly.any():
        a, b, c = sun_rad[partly], earth_rad[partly], apart_rad[partly]
        # Distance of the common chord from the Sun's centre, and half its length.
        x = (c * c + a * a - b * b) / (2 * c)
        y = np.sqrt(np.maximum(a * a - x * x, 0.0))
        overlap = a * a * np.arctan2(y, x) + b * b * np.arctan2(y, c - x) - c * y
        lit[partly] = 1 - overlap / (np.pi * a * a)
    return lit


def pressure_npm2(pos_m: F64, sun_m: F64) -> F64:
    """Pressure of sunlight (k, 3) [N/m^2] on a body that absorbs it, along its way, shadow included.

    pos_m, sun_m  (k, 3) craft and Sun, any one frame about the Earth's centre [m]
    """
    from_sun_m = pos_m - sun_m
    distance_m = np.linalg.norm(from_sun_m, axis=1)
    strength = PRESSURE_AT_AU_NPM2 * (AU_M / distance_m) ** 2 * sunlit_fraction(pos_m, sun_m)
    return from_sun_m * (strength / distance_m)[:, None]
