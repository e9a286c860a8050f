"""Oscillators: bounded, of the stated rate."""

import numpy as np
import pytest

from emulator.signals import clock


def test_wander_is_bounded_and_its_rate_is_its_derivative():
    wander = clock.Wander(1e-3, 2 * np.pi / 5400, np.linspace(0, 6, clock.DOMAINS))
    for t_s in np.linspace(0, 5400, 50):
        offset, rate = clock.offset_s(wander, t_s)
        h = 0.5
        difference = (clock.offset_s(wander, t_s + h)[0] - clock.offset_s(wander, t_s - h)[0]) / (2 * h)
        assert np.abs(offset).max() <= 1e-3
        assert rate == pytest.approx(difference, rel=1e-6, abs=1e-13)
        assert np.abs(rate).max() <= clock.fastest(wander)
