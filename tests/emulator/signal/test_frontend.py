"""Noise of the front end against a published worked example, thermal balance, and the definition of the noise
figure."""

import numpy as np
import pytest
from scipy import constants

from gnss_hil.emulator.signal import frontend


def figure_db(receiver_k):
    """Noise figure of a receiver of this temperature, by the figure's definition."""
    return 10 * np.log10(1 + receiver_k / 290.0)


@pytest.mark.verifies(
    "emulator/signal/frontend.py",
    what="System noise temperature",
    by="Roddy's worked example of a cable before the amplifier, 1136 K; thermal balance of a line",
    status="validated",
)
def test_a_cable_before_the_amplifier_costs_what_the_textbook_says():
    """Antenna of 35 K, cable of 5 dB at 290 K, amplifier of 150 K: 1136 K at the cable's input.

    Source: D. Roddy, Satellite Communications, 4th ed., 2006, example 12.8. The book rounds the loss to 3.16;
    a last stage behind 50 dB of gain, which it counts too, makes 0.1 K.
    """
    assert frontend.system_temperature_k(35.0, 5.0, 290.0, figure_db(150.0)) == pytest.approx(1136, abs=1)


@pytest.mark.parametrize("line_k", [100.0, 290.0, 350.0])
def test_a_line_as_warm_as_what_the_antenna_sees_takes_signal_but_adds_no_noise(line_k):
    """Thermal balance: behind the line there is the noise of the same temperature as before it."""
    loss = 10**0.2
    at_antenna_k = frontend.system_temperature_k(line_k, 2.0, line_k, figure_db(75.0))
    assert at_antenna_k / loss == pytest.approx(line_k + 75.0)


def test_a_noise_figure_of_three_decibel_doubles_the_noise_of_a_standard_source():
    assert frontend.system_temperature_k(290.0, 0.0, 290.0, 10 * np.log10(2)) == pytest.approx(580.0)


def test_density_is_boltzmanns():
    assert frontend.density_wphz(290.0) == pytest.approx(constants.k * 290.0, rel=1e-12)
