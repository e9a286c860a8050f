"""The density of the upper atmosphere: Harris and Priester's, with its bulge that follows the Sun.

It stands for mean solar activity. From quiet to active Sun the air at 400 km changes tenfold: a craft's drag
area is where such knowledge of the day goes.
Source: Montenbruck & Gill, Satellite Orbits, 3.5.2 and table 3.8 (modified Harris-Priester model, after
Long et al., GTDS Mathematical Theory, 1989)
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.earth.constants import ECCENTRICITY2, EQUATORIAL_RADIUS_M, POLAR_RADIUS_M

# Altitude [km], density [g/km^3] at the antapex and the apex of the bulge.
_TABLE = np.array((
    (100, 497400.0, 497400.0), (120, 24900.0, 24900.0), (130, 8377.0, 8710.0), (140, 3899.0, 4059.0),
    (150, 2122.0, 2215.0), (160, 1263.0, 1344.0), (170, 800.8, 875.8), (180, 528.3, 601.0),
    (190, 361.7, 429.7), (200, 255.7, 316.2), (210, 183.9, 239.6), (220, 134.1, 185.3),
    (230, 99.49, 145.5), (240, 74.88, 115.7), (250, 57.09, 93.08), (260, 44.03, 75.55),
    (270, 34.30, 61.82), (280, 26.97, 50.95), (290, 21.39, 42.26), (300, 17.08, 35.26),
    (320, 10.99, 25.11), (340, 7.214, 18.19), (360, 4.824, 13.37), (380, 3.274, 9.955),
    (400, 2.249, 7.492), (420, 1.558, 5.684), (440, 1.091, 4.355), (460, 0.7701, 3.362),
    (480, 0.5474, 2.612), (500, 0.3916, 2.042), (520, 0.2819, 1.605), (540, 0.2042, 1.267),
    (560, 0.1488, 1.005), (580, 0.1092, 0.7997), (600, 0.08070, 0.6390), (620, 0.06012, 0.5123),
    (640, 0.04519, 0.4121), (660, 0.03430, 0.3325), (680, 0.02632, 0.2691), (700, 0.02043, 0.2185),
    (720, 0.01607, 0.1779), (740, 0.01281, 0.1452), (760, 0.01036, 0.1190), (780, 0.008496, 0.09776),
    (800, 0.007069, 0.08059), (840, 0.004680, 0.05741), (880, 0.003200, 0.04210), (920, 0.002210, 0.03130),
    (960, 0.001560, 0.02360), (1000, 0.001150, 0.01810),
)).T  # fmt: skip
_ALTITUDE_M = 1e3 * _TABLE[0]
_LOG_ANTAPEX, _LOG_APEX = np.log(1e-12 * _TABLE[1:])
_LAG_RAD = np.deg2rad(30.0)
"""How far the bulge is behind the Sun: about 14 h local time."""

_SECOND_ECCENTRICITY2 = ECCENTRICITY2 / (1 - ECCENTRICITY2)


def altitude_m(pos_m: F64) -> F64:
    """Height (k,) above the WGS-84 ellipsoid [m] of positions (k, 3) in any axes about the Earth's.

    Good to 0.1 mm at all heights of orbits. Source: Bowring, Survey Review 23 (181), 1976
    """
    across_m, z_m = np.hypot(pos_m[:, 0], pos_m[:, 1]), pos_m[:, 2]
    a_m, b_m = EQUATORIAL_RADIUS_M, POLAR_RADIUS_M
    reduced = np.arctan2(a_m * z_m, b_m * across_m)
    latitude = np.arctan2(
        z_m + _SECOND_ECCENTRICITY2 * b_m * np.sin(reduced) ** 3,
        across_m - ECCENTRICITY2 * a_m * np.cos(reduced) ** 3,
    )
    sin = np.sin(latitude)
    return across_m * np.cos(latitude) + z_m * sin - a_m * np.sqrt(1 - ECCENTRICITY2 * sin * sin)


def density_kgpm3(pos_eci_m: F64, sun_eci_m: F64, exponent: float) -> F64:
    """Density of the air (k,) [kg/m^3] at positions (k, 3), with the Sun at (k, 3), eci [m].

    exponent  of the bulge: 2 for orbits of low inclination, 6 for polar ones
    returns   zero above 1000 km; nan below 100 km, where the table ends
    Source: Montenbruck & Gill, eqs. 3.99 to 3.102
    """
    height_m = altitude_m(pos_eci_m)
    low = np.exp(np.interp(height_m, _ALTITUDE_M, _LOG_ANTAPEX, left=np.nan, right=-np.inf))
    high = np.exp(np.interp(height_m, _ALTITUDE_M, _LOG_APEX, left=np.nan, right=-np.inf))
    cos, sin = np.cos(_LAG_RAD), np.sin(_LAG_RAD)
    x, y, z = pos_eci_m.T
    bulge = (
        (cos * x + sin * y) * sun_eci_m[:, 0] + (cos * y - sin * x) * sun_eci_m[:, 1] + z * sun_eci_m[:, 2]
    )
    cos_away = bulge / np.sqrt(
        np.einsum("ij,ij->i", pos_eci_m, pos_eci_m) * np.einsum("ij,ij->i", sun_eci_m, sun_eci_m)
    )
    return low + (high - low) * np.maximum(0.5 + 0.5 * cos_away, 0.0) ** (0.5 * exponent)
