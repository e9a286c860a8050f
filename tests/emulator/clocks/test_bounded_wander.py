"""Oscillators: bounded, of the stated rate."""

import numpy as np
import pytest

from gnss_hil.emulator.clocks import bounded_wander

pytestmark = pytest.mark.verifies(
    "emulator/clocks/bounded_wander.py",
    what="Receiver clocks",
    by="bounded sinusoidal wander",
    status="modelled",
)


def test_wander_is_bounded_and_its_rate_is_its_derivative():
    wander = bounded_wander.Wander(1e-3, 2 * np.pi / 5400, np.linspace(0, 6, bounded_wander.DOMAINS))
    for t_s in np.linspace(0, 5400, 50):
        offset, rate = bounded_wander.offset_s(wander, t_s)
        h = 0.5
        difference = (
            bounded_wander.offset_s(wander, t_s + h)[0] - bounded_wander.offset_s(wander, t_s - h)[0]
        ) / (2 * h)
        assert np.abs(offset).max() <= 1e-3
        assert rate == pytest.approx(difference, rel=1e-6, abs=1e-13)
        assert np.abs(rate).max() <= bounded_wander.fastest(wander)
