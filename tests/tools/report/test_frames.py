"""Frames of the report against formulas of other kinds and against published numbers."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.earth.constants import ROTATION_RPS, eci_to_ecef
from gnss_hil.tools.report.frames import covariance, geodetic, inertial, radial_along_cross, sigmas_along

pytestmark = pytest.mark.verifies(
    "tools/report/frames.py",
    what="Report: radial, along, cross axes, sigma along them, geodetic coordinates",
    by="circular orbit by elements; Monte Carlo; closed formula of WGS-84",
    status="validated",
)

RADIUS_M, SPEED_MPS, INCLINATION = 6.8e6, 7656.0, np.radians(51.6)


def circular(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place, velocity and orbit normal in standing axes at arguments of latitude u (n,), node on x."""
    c, s = np.cos(INCLINATION), np.sin(INCLINATION)
    place = RADIUS_M * np.column_stack([np.cos(u), c * np.sin(u), s * np.sin(u)])
    velocity = SPEED_MPS * np.column_stack([-np.sin(u), c * np.cos(u), s * np.cos(u)])
    return place, velocity, np.array([0, -s, c])


def test_axes_of_a_circular_orbit_are_its_own():
    """By orbital elements: radial is the place, along the velocity, cross the normal."""
    place, velocity, normal = circular(np.linspace(0, 6, 50))
    earth_relative = velocity - np.cross([0, 0, ROTATION_RPS], place)
    axes = radial_along_cross(place, earth_relative)
    assert np.allclose(axes[:, 0], place / RADIUS_M, atol=1e-12)
    assert np.allclose(axes[:, 1], velocity / SPEED_MPS, atol=1e-12)
    assert np.allclose(axes[:, 2], normal, atol=1e-12)


def test_without_the_earths_rotation_the_axes_would_be_degrees_off():
    place, velocity, normal = circular(np.array([0.3]))
    (axes,) = radial_along_cross(place, velocity)
    assert np.degrees(np.arccos(axes[2] @ normal)) > 1


def test_sigmas_along_axes_are_those_of_a_cloud_of_errors():
    """By Monte Carlo: errors drawn in ECEF with the given sigmas and correlations, turned one by one."""
    sigma, rho = np.array([[3.0, 1.0, 2.0]]), np.array([[0.6, -0.3, 0.1]])
    place, velocity, _ = circular(np.array([1.1]))
    axes = radial_along_cross(place, velocity)
    matrix = covariance(sigma, rho)
    errors = np.random.default_rng(5).multivariate_normal(np.zeros(3), matrix[0], 200_000)
    assert np.sqrt(np.diagonal(matrix[0])) == pytest.approx(sigma[0])
    assert matrix[0, 0, 1] == pytest.approx(0.6 * 3.0 * 1.0)
    assert matrix[0, 1, 2] == pytest.approx(0.1 * 1.0 * 2.0)
    assert sigmas_along(axes, matrix)[0] == pytest.approx((errors @ axes[0].T).std(axis=0), rel=0.01)


def test_what_is_no_covariance_has_no_sigma(recwarn):
    impossible = covariance(np.ones((1, 3)), np.array([[1.0, 1.0, -1.0]]))
    axes = np.array([[[1, 0, 0], [0, 1, -1], [0, 1, 1]]]) / np.sqrt([[[1], [2], [2]]])
    skew = np.array([[[1.0, -1, -1], [0, 1, 0], [0, 0, 1]]]) / np.sqrt([[[3], [1], [1]]])
    assert np.isfinite(sigmas_along(axes, impossible)[0, 0])
    assert np.isnan(sigmas_along(skew, impossible)[0, 0])
    assert not recwarn.list


def test_inertial_axes_undo_the_earths_rotation():
    t_ns = np.array([0, 600, 86_164]) * 1_000_000_000 + 10**18
    standing = np.array([7e6, 1e6, 3e6])
    turned = np.array([eci_to_ecef(standing, ROTATION_RPS * (t - t_ns[0]) / 1e9) for t in t_ns])
    assert np.allclose(inertial(turned, t_ns), standing, atol=1e-6)


@pytest.mark.parametrize(
    ("lon", "lat", "height"),
    [(0, 0, 0), (12.5, 48.1, 520.0), (-70.4, -53.2, 4.2e5), (179.9, 89.99, 3e7), (90, -90, 35_786e3)],
)
def test_geodetic_undoes_the_closed_formula_of_ecef(lon, lat, height):
    """ECEF from geodetic is closed. Source: NGA.STND.0036 (WGS-84), 4.1 and table 3.1."""
    a, f = 6378137.0, 1 / 298.257223563
    e2, p, q = f * (2 - f), np.radians(lat), np.radians(lon)
    n = a / np.sqrt(1 - e2 * np.sin(p) ** 2)
    ecef = [(n + height) * np.cos(p) * np.cos(q), (n + height) * np.cos(p) * np.sin(q),
            (n * (1 - e2) + height) * np.sin(p)]  # fmt: skip
    found = np.array(geodetic(np.array([ecef])))[:, 0]
    assert found[1:] == pytest.approx([lat, height], abs=1e-5)
    assert abs(lat) == 90 or found[0] == pytest.approx(lon, abs=1e-9)
