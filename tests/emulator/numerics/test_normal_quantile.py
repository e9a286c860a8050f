"""The normal quantile against SciPy's, over all that draws reach."""

import numpy as np
import pytest
from scipy.special import ndtri

from gnss_hil.emulator.numerics.normal_quantile import TAIL, normal_quantile


@pytest.mark.verifies(
    "emulator/numerics/normal_quantile.py",
    what="Standard normal numbers of uniform ones",
    by="SciPy's ndtri, in middle, tails, far tails and where they meet",
    status="validated",
)
def test_is_that_of_scipy():
    """In the middle to the last bit. In the tails to a few units of it: logarithms of libraries differ."""
    draw = np.random.default_rng(1)
    smallest = 2.0**-53
    below = 10.0 ** draw.uniform(np.log10(smallest), 0, 100_000)
    edges = np.array((smallest, 0.5, TAIL, np.nextafter(TAIL, 1), 1 - TAIL, np.exp(-32), 1 - smallest))
    p = np.concatenate((draw.random(100_000), below, 1 - below[below > 1e-15], edges))
    p = p[(p > 0) & (p < 1)]
    found, expected = normal_quantile(p), ndtri(p)
    middle = (p > TAIL) & (p <= 1 - TAIL)
    assert (found[middle] == expected[middle]).all()
    assert found[~middle] == pytest.approx(expected[~middle], rel=2e-15, abs=0)


def test_keeps_the_shape():
    p = np.random.default_rng(2).random((2, 3, 4))
    assert (normal_quantile(p) == normal_quantile(p.reshape(-1)).reshape(p.shape)).all()
    assert normal_quantile(np.empty(0)).shape == (0,)
