"""EGM2008: published coefficients; heyoka's own harmonics; a potential summed and differentiated by SciPy."""

from __future__ import annotations

from math import factorial

import numpy as np
import pytest
from scipy.special import assoc_legendre_p_all

from gnss_hil.emulator.earth import gravity
from gnss_hil.emulator.earth.constants import MU_M3PS2
from gnss_hil.emulator.orbits import forces
from tests.support.outside import peer

pytestmark = pytest.mark.verifies(
    "emulator/earth/gravity.py",
    what="Gravity field",
    by=(
        "EGM2008's published coefficients; heyoka's EGM2008 to 1e-14 m/s^2 at degree 50; the gradient of "
        "SciPy's Legendre sums"
    ),
    status="validated",
)

RNG = np.random.default_rng(7)
DIRECTIONS = RNG.normal(size=(40, 3))
POINTS_M = DIRECTIONS * (np.geomspace(6.5e6, 4.3e7, 40) / np.linalg.norm(DIRECTIONS, axis=1))[:, None]


def test_coefficients_of_low_degree_are_the_published_ones():
    """ICGEM's EGM2008.gfc (tide-free); zonals also in NGA.STND.0036 1.0.0, table 5.1."""
    c, s = gravity.coefficients(8)
    assert c[2, :3].tolist() == [-0.484165143790815e-3, -0.206615509074176e-9, 0.243938357328313e-5]
    assert s[2, 1:3].tolist() == [0.138441389137979e-8, -0.140027370385934e-5]
    assert (c[3, 3], c[4, 1], c[5, 0]) == (0.721321757121568e-6, -0.536157389388867e-6, 0.686702913736681e-7)
    assert (c[6, 0], c[7, 0], c[8, 0]) == (
        *(-0.149953927978527e-6, 0.905120844521618e-7, 0.494756003005199e-7),
    )
    assert not c[:2].any() and not s[:, 0].any()


def test_coefficients_are_heyokas():
    heyoka = peer("heyoka")
    c, s = gravity.coefficients(gravity.HIGHEST_DEGREE)
    rows, columns = np.tril_indices(gravity.HIGHEST_DEGREE + 1)
    expected = heyoka.model.get_egm2008_CS()[: len(rows) - 3]
    assert np.stack((c[rows, columns], s[rows, columns]), 1)[3:].tolist() == expected.tolist()


@pytest.mark.parametrize("degree", [2, 3, 20, pytest.param(50, marks=pytest.mark.slow)])
def test_acceleration_is_heyokas(degree):
    heyoka = peer("heyoka")
    variables = heyoka.make_vars("x", "y", "z")
    expressions = heyoka.model.egm2008_acc(variables, degree, degree, mu=MU_M3PS2)
    # Compiled in a hurry: it is called once.
    function = heyoka.cfunc(expressions, variables, compact_mode=True, opt_level=0)
    expected = function(np.ascontiguousarray(POINTS_M.T)).T
    central = forces.central(np.zeros(40, np.int64), POINTS_M, POINTS_M)
    assert np.abs(central + gravity.field(degree)(POINTS_M) - expected).max() < 1e-14


def potential(pos_m, degree):
    """Disturbing potential (k,) by its definition: SciPy's Legendre functions, longitudes, coefficients."""
    c, s = gravity.coefficients(degree)
    r = np.linalg.norm(pos_m, axis=1)
    longitude = np.arctan2(pos_m[:, 1], pos_m[:, 0])
    legendre = assoc_legendre_p_all(degree, degree, pos_m[:, 2] / r)[0]
    total = np.zeros(len(pos_m))
    for n in range(2, degree + 1):
        for m in range(n + 1):
            norm = np.sqrt((2 - (m == 0)) * (2 * n + 1) * factorial(n - m) / factorial(n + m))
            angle = c[n, m] * np.cos(m * longitude) + s[n, m] * np.sin(m * longitude)
            # SciPy's functions carry the phase (-1)^m of Condon and Shortley, geodesy's do not.
            total += (gravity.REFERENCE_RADIUS_M / r) ** n * (-1) ** m * norm * legendre[n, m] * angle
    return MU_M3PS2 / r * total


def test_acceleration_is_the_gradient_of_the_potential():
    step_m = 200.0
    gradient = [
        (8 * (potential(POINTS_M + d, 20) - potential(POINTS_M - d, 20))
         - potential(POINTS_M + 2 * d, 20) + potential(POINTS_M - 2 * d, 20)) / (12 * step_m)
        for d in step_m * np.eye(3)
    ]  # fmt: skip
    assert np.abs(np.stack(gradient, 1) - gravity.field(20)(POINTS_M)).max() < 1e-10


def test_zonal_rows_are_the_fields_own_at_low_degree():
    c, _ = gravity.coefficients(4)
    assert {n: -np.sqrt(2 * n + 1) * c[n, 0] for n in (2, 3, 4)} == forces.ZONAL


def test_poles_and_axes_are_places_like_others():
    """Where longitude or its cosine has no meaning: the field there is that of places beside."""
    places_m = 7e6 * np.array(((0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 1, 0)), float)
    beside_m = places_m + 0.01
    field = gravity.field(50)
    assert np.isfinite(field(places_m)).all()
    assert np.abs(field(places_m) - field(beside_m)).max() < 1e-9
