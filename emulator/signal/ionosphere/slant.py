"""Electron content along a ray, for a craft below, inside or above the ionosphere.

A ray is measured by s, the distance from its point nearest to the Earth's centre (which may lie on its
extension): r^2 = nearest^2 + s^2. It is cut where it passes a few heights of the profile, on its way down and
on its way up, and each piece gets Gauss-Legendre nodes. Pieces that a ray does not have cost nothing. The
vertical content is read at the place below every node, not at one pierce point (the middle of its content):
with the maps of 2017-01-01 that would be wrong by 0.07 m (rms, L1) for rays above 30 deg, 0.3 m below 10 deg,
1.7 m below the horizon.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.earth.constants import ECCENTRICITY2, POLAR_RADIUS_M
from gnss_hil.emulator.signal.geometry import norm
from gnss_hil.emulator.signal.ionosphere.field import Field
from gnss_hil.emulator.signal.ionosphere.profile import Profile, density_pm

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
"""Six a piece: 1e-3 of the content, for all profiles that a scenario may name."""


def _surface_m(across2: F64, radius2: F64) -> F64:
    """Radius of the WGS-84 ellipsoid (...,) [m] below points with x^2 + y^2 = across2 and r^2 = radius2.

    r minus it differs from the geodetic height by 6e-6 of the height at most: 3 m at 500 km.
    """
    return POLAR_RADIUS_M / np.sqrt(1 - ECCENTRICITY2 * (across2 / radius2))


def _cuts_m(profile: Profile) -> F64:
    """Heights (6,) [m] at which rays are cut; below the first there are no electrons."""
    thin, thick, wide = profile.bottomside_m, profile.topside_m, profile.plasmasphere_m
    return profile.peak_m + np.sort((-3.5 * thin, 0.0, 4 * thick, 12 * thick, 30 * thick, 2 * wide))


def slant_tec_tecu(
    field: Field, t_ns: int, pos_ecef_m: F64, pos_sv_ecef_m: F64, later_s: F64 | float = 0.0
) -> F64:
    """Electron content (p,) [TECU] between receivers and satellites.

    pos_ecef_m     (3,) or (p, 3) receiving antennas
    pos_sv_ecef_m  (p, 3) satellites; that they have moved 300 m since transmission does not count
    later_s        (p,) or a number: each ray's instant is t_ns + later_s
    """
    span = pos_sv_ecef_m - pos_ecef_m
    length = norm(span)
    los = span / length[:, None]
    start = np.einsum("...k,...k->...", pos_ecef_m, los)
    end = start + length
    origin = pos_ecef_m - start[:, None] * los
    nearest2 = np.einsum("pk,pk->p", origin, origin)

    lowest = origin + np.minimum(np.maximum(0.0, start), end)[:, None] * los
    square = np.square(lowest)
    surface = _surface_m(square[:, 0] + square[:, 1], square.sum(axis=1))
    radius = surface[:, None] + _cuts_m(field.profile)
    up = np.sqrt(np.maximum(radius * radius - nearest2[:, None], 0.0))
    bounds = np.concatenate((start[:, None], -up[:, ::-1], up, end[:, None]), axis=1)
    bounds = np.minimum(np.maximum(bounds, start[:, None]), end[:, None])
    half = 0.5 * np.diff(bounds, axis=1)
    half[:, up.shape[1]] = 0.0
    ray, piece = np.nonzero(half)
    half = half[ray, piece]

    s = (bounds[ray, piece] + half)[:, None] + half[:, None] * _NODES
    x, y, z = (origin[ray, k, None] + s * los[ray, k, None] for k in range(3))
    across2 = x * x + y * y
    radius2 = across2 + z * z
    height = np.sqrt(radius2) - _surface_m(across2, radius2)
    later = np.broadcast_to(later_s, length.shape)[ray, None]
    vertical = field.vertical_tecu(t_ns, later, np.arctan2(z, np.sqrt(across2)), np.arctan2(y, x))
    content = half * ((density_pm(field.profile, height) * vertical) @ _WEIGHTS)
    return np.bincount(ray, content, len(length)).astype(np.float64, copy=False)


APART_S = 0.5


def slant_tec_and_rate(
    field: Field,
    t_ns: int,
    pos_ecef_m: F64,
    vel_ecef_mps: F64,
    pos_sv_ecef_m: F64,
    vel_sv_ecef_mps: F64,
    later_s: F64 | float = 0.0,
) -> tuple[F64, F64]:
    """Electron content (p,) [TECU] and its derivative by time (p,) [TECU/s], along with both ends' motion.

    (p, 3) each; velocities relative to the turning Earth; later_s (p,) or a number: each ray's instant is
    t_ns + later_s. From two instants a quarter of a second before and
    after: their mean and their difference, which leaves out 2e-5 of the content of rays that graze the peak.
    The nodes move with the ray: rates have 0.1 % of error from that, 1 % for rays that pass below the peak.
    """
    step = np.array((-0.5, 0.5))[:, None, None] * APART_S
    receivers = (pos_ecef_m + step * vel_ecef_mps).reshape(-1, 3)
    satellites = (pos_sv_ecef_m + step * vel_sv_ecef_mps).reshape(-1, 3)
    later_s = (np.broadcast_to(later_s, len(pos_sv_ecef_m)) + step[:, :, 0]).reshape(-1)
    before, after = slant_tec_tecu(field, t_ns, receivers, satellites, later_s).reshape(2, -1)
    return 0.5 * (before + after), (after - before) / APART_S
