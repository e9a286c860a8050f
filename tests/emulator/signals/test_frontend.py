"""Noise of the front end against a published cascade and the definition of the noise figure."""

import numpy as np
import pytest
from scipy import constants

from emulator.signals import frontend


def test_cascade_of_seven_stages():
    """MathWorks, Phased Array System Toolbox, `noisefigure`, first example: 1.5252 dB."""
    noise_figure_db = [1.0, 0.5, 5.0, 1.0, 0.6, 1.0, 6.0]
    gain_db = [15.0, -0.5, -7.0, -1.0, 15.0, 20.0, -5.0]
    assert frontend.cascade_noise_figure_db(noise_figure_db, gain_db) == pytest.approx(1.5252, abs=5e-5)


def test_a_line_at_standard_temperature_is_a_stage_of_the_cascade():
    figure_db = frontend.cascade_noise_figure_db([1.3, 2.0], [-1.3, 20.0])
    expected_k = 100.0 + 290.0 * (10 ** (figure_db / 10) - 1)
    assert frontend.system_temperature_k(100.0, 1.3, 290.0, 2.0) == pytest.approx(expected_k, rel=1e-12)


def test_a_noise_figure_of_three_decibel_doubles_the_noise_of_a_standard_source():
    assert frontend.system_temperature_k(290.0, 0.0, 290.0, 10 * np.log10(2)) == pytest.approx(580.0)


def test_density_is_boltzmanns():
    assert frontend.density_wphz(290.0) == pytest.approx(constants.k * 290.0, rel=1e-12)
