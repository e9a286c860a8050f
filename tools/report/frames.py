"""Positions in the frames in which a report shows them."""

from __future__ import annotations

import erfa
import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.flightsw.orbit.earth import ROTATION_RPS

_WGS84 = 1
"""ERFA's number of the ellipsoid."""

Vectors = F64


def radial_along_cross(position_m: Vectors, velocity_mps: Vectors) -> Vectors:
    """Axes of the orbit: rows radial (up), along (with the motion, square to radial), cross (the orbit's
    normal), (n, 3, 3), ECEF coordinates; C v_ecef gives v_rac.

    position_m, velocity_mps   (n, 3) ECEF; velocity relative to the Earth. The orbit is the inertial one:
                               the Earth's rotation is added.
    """
    inertial = velocity_mps + np.cross([0.0, 0.0, ROTATION_RPS], position_m)
    radial = _unit(position_m)
    cross = _unit(np.cross(position_m, inertial))
    return np.stack([radial, np.cross(cross, radial), cross], axis=1)


def covariance(sigma_m: Vectors, rho: Vectors) -> F64:
    """(n, 3, 3) [m^2] of standard deviations (n, 3) of x, y, z and correlations (n, 3) xy, xz, yz."""
    xy, xz, yz = rho.T
    one = np.ones_like(xy)
    correlation = np.stack([one, xy, xz, xy, one, yz, xz, yz, one], axis=-1).reshape(-1, 3, 3)
    return correlation * sigma_m[:, :, None] * sigma_m[:, None, :]


def sigmas_along(axes: Vectors, covariance_m2: F64) -> Vectors:
    """(n, 3) standard deviations [m] along the rows of axes (n, 3, 3); nan where it is no covariance."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.einsum("nij,njk,nik->ni", axes, covariance_m2, axes))


def inertial(position_ecef_m: Vectors, t_ns: I64) -> Vectors:
    """(n, 3) in axes that stand still and coincide with ECEF at the first instant."""
    angle = (t_ns - t_ns[:1]) * (ROTATION_RPS / 1e9)
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = position_ecef_m.T
    return np.column_stack([cos * x - sin * y, sin * x + cos * y, z])


def geodetic(position_m: Vectors) -> tuple[Vectors, Vectors, Vectors]:
    """Longitude, latitude [deg] and height [m] (n,) over WGS-84 of ECEF positions (n, 3)."""
    longitude, latitude, height_m = erfa.gc2gd(_WGS84, position_m)
    return np.degrees(longitude), np.degrees(latitude), height_m


def _unit(vectors: Vectors) -> Vectors:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
