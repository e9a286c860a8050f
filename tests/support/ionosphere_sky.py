"""A craft in the station's orbit and satellites in circles: where things are, for tests of the ionosphere."""

from __future__ import annotations

import numpy as np

from gnss_hil.emulator.earth.constants import MU_M3PS2, ROTATION_RPS

CRAFT_M, GPS_M, EARTH_M = 6_793e3, 26_560e3, 6_378e3


def _circle(radius_m, phase_rad, inclination_rad, node_rad):
    cos, sin = np.cos(phase_rad), np.sin(phase_rad)
    across = sin * np.cos(inclination_rad)
    x = cos * np.cos(node_rad) - across * np.sin(node_rad)
    y = cos * np.sin(node_rad) + across * np.cos(node_rad)
    return radius_m * np.stack((x, y, sin * np.sin(inclination_rad)), axis=-1)


def craft_m(t_s, ahead_m=0.0):
    """ECEF (3,) of a craft at 415 km, 51.6 deg; another `ahead_m` before it."""
    phase = np.sqrt(MU_M3PS2 / CRAFT_M**3) * t_s + ahead_m / CRAFT_M
    return _circle(CRAFT_M, phase, np.deg2rad(51.6), 0.3 - ROTATION_RPS * t_s)


def satellites_m(t_s):
    """ECEF (24, 3): four in each of six planes."""
    k = np.arange(24)
    phase = np.sqrt(MU_M3PS2 / GPS_M**3) * t_s + k % 4 * np.pi / 2 + k // 4 * 0.7
    return _circle(GPS_M, phase, np.deg2rad(55), k // 4 * np.pi / 3 - ROTATION_RPS * t_s)


def seen(pos_m, sv_m):
    """(n,) which satellites the Earth does not hide, 50 km of air included."""
    los = (sv_m - pos_m) / np.linalg.norm(sv_m - pos_m, axis=1)[:, None]
    along = los @ pos_m
    return (along > 0) | (pos_m @ pos_m - along**2 > (EARTH_M + 50e3) ** 2)
