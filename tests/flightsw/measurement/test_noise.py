"""Noise of pseudoranges and range rates: published figures, and the scatter that emulated receivers show."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.dbc.common.vehicle import ReceiverFigures
from gnss_hil.emulator.signal.loops import Loops, code_sigma_chips, doppler_sigma_hz
from gnss_hil.flightsw.measurement.noise import receiver_noise
from tests.support.budgets import BUDGET

pytestmark = pytest.mark.verifies(
    "flightsw/measurement/noise.py",
    "flightsw/measurement/options.py",
    what="Noise of ranges and rates by C/N0",
    by="Kaplan & Hegarty's figures in metres by hand; the emulator's loops, written apart",
    status="validated",
)

LIGHT = 299_792_458.0
CN0 = np.array([10 ** (x / 10) for x in (28.0, 35.0, 45.0, 52.0)])


def code_sigma_m(name, cn0_dbhz=45.0, **figures):
    noise = receiver_noise(ReceiverFigures(**figures))
    ratio = np.array([10 ** (cn0_dbhz / 10)])
    return float(np.sqrt(noise.code_variance_m2(ratio, np.array([SIGNALS[name].value])))[0])


def test_at_45_dbhz():
    """293.05 m sqrt(0.5 Hz 0.5 / (2 31,623 Hz) (1 + 2 / (1.5 0.02 s 31,623 Hz))) = 0.583 m; a chip of
    GLONASS is 1.023 / 0.511 as long, one of the P code a tenth."""
    assert code_sigma_m("L1CA") == pytest.approx(0.583, abs=0.001)
    assert code_sigma_m("L1OF") == pytest.approx(0.583 * 1.023 / 0.511, abs=0.002)
    assert code_sigma_m("L1P") == pytest.approx(0.0583, abs=0.0001)


@pytest.mark.parametrize("spacing", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("integration_s", [0.001, 0.02])
def test_emulated_loops_scatter_as_much(spacing, integration_s):
    figures = {"correlator_spacing_chips": spacing, "integration_s": integration_s}
    loops = Loops(**figures)
    noise = receiver_noise(ReceiverFigures(**figures))
    l1, frequency = np.zeros(len(CN0), int), np.zeros(len(CN0))
    chip_m, wave_m = LIGHT / 1.023e6, LIGHT / 1575.42e6
    code = noise.code_variance_m2(CN0, l1)
    assert np.sqrt(code) == pytest.approx(chip_m * code_sigma_chips(CN0, loops), rel=1e-9)
    rate = noise.rate_variance_m2ps2(CN0, l1, frequency)
    assert np.sqrt(rate) == pytest.approx(wave_m * doppler_sigma_hz(CN0, loops), rel=1e-9)


def test_reflections_go_by_the_chip_and_filters_by_the_carrier():
    """What no C/N0 takes away, at a C/N0 that leaves no noise."""
    assert code_sigma_m("L1CA", 150, multipath_m=0.7) == pytest.approx(0.7, rel=1e-4)
    assert code_sigma_m("L1P", 150, multipath_m=0.7) == pytest.approx(0.07, rel=1e-4)
    assert code_sigma_m("L1OF", 150, multipath_m=0.3, channel_delay_m=0.8) == pytest.approx(1.0, rel=1e-2)
    assert code_sigma_m("L1CA", 150, channel_delay_m=0.8) < 1e-3
    assert code_sigma_m("L2C", 150, band_delay_m=0.3) == pytest.approx(0.3, rel=1e-4)
    assert code_sigma_m("L1CA", 150, band_delay_m=0.3) < 1e-3


def test_a_signal_may_have_a_figure_of_its_own():
    assert code_sigma_m("L2P", code_noise_m={"L2P": 0.3}) == pytest.approx(0.3, rel=2e-3)
    assert code_sigma_m("L2P", 35.0, code_noise_m={"L2P": 0.3}) == pytest.approx(0.3 * 10**0.5, rel=0.02)
    assert code_sigma_m("L1P", code_noise_m={"L2P": 0.3}) == pytest.approx(0.0583, abs=0.0001)


def test_what_is_no_signal_is_noisy_and_no_error():
    """A receiver may say any of sixteen numbers."""
    code = BUDGET.noise.code_variance_m2(CN0[:1], np.array([15]))
    assert np.isfinite(code).all() and code[0] > 0.3
