"""Delays from contents, and the effect on observables."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import constants

from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models import ionosphere
from gnss_hil.emulator.signal.geometry import spin
from gnss_hil.emulator.signal.ionosphere.delay import REFRACTION_M3PS2, delay_m, tecu_of_delay_m
from gnss_hil.emulator.signal.ionosphere.field import of_coefficients
from gnss_hil.emulator.signal.ionosphere.presets import PRESETS
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_tecu

T_NS = 1_300_000_000_000_000_000


def test_constant_is_codatas():
    plasma = constants.e**2 / (8 * np.pi**2 * constants.epsilon_0 * constants.m_e)
    assert pytest.approx(plasma, rel=1e-7) == REFRACTION_M3PS2


def test_published_delay_of_one_unit():
    """0.162 m for one TECU on GPS L1, 0.267 m on L2 (Kaplan & Hegarty; Hofmann-Wellenhof et al.: 16 cm)."""
    assert delay_m(np.array(1.0), 1575.42e6) == pytest.approx(0.162, abs=5e-4)
    assert delay_m(np.array(1.0), 1227.60e6) == pytest.approx(0.267, abs=5e-4)
    assert tecu_of_delay_m(delay_m(np.array(7.0), 1575.42e6), 1575.42e6) == pytest.approx(7.0)


def at(t_s, field):
    """The effect on three signals, antennas and satellites moving uniformly, relative to the Earth."""
    pos = np.array([[5.0e6, 2.0e6, 4.1e6], [5.0e6, 2.0e6, 4.1e6 + 2]])
    vel = np.array([[-3e3, 6e3, 1e3], [-3e3, 6e3, 1e3]])
    sv = np.array([[2.0e7, 1.2e7, 1.2e7], [5.0e6, 2.5e7, -2.0e6], [-8e6, 3e6, 2.4e7]])
    vel_sv = np.array([[1e3, -2e3, 2e3], [-2e3, 1e3, 1e3], [2e3, 1e3, 0.0]])
    pos = pos + t_s * vel
    # One block of one epoch.
    epochs = SimpleNamespace(
        t_ns=np.array([T_NS + round(t_s * 1e9)]),
        antennas=SimpleNamespace(pos_m=pos[None], vel_mps=(vel + spin(pos))[None]),
        sky=SimpleNamespace(pos_ecef_m=(sv + t_s * vel_sv)[None], vel_ecef_mps=vel_sv[None]),
    )
    wave_m = LIGHT_MPS / np.array([1575.42e6, 1602e6, 1575.42e6])
    signals = SimpleNamespace(
        epochs=epochs,
        at=np.zeros(3, int),
        receiver=np.array([0, 1, 1]),
        row=np.array([0, 1, 2]),
        wave_m=wave_m,
    )
    return ionosphere.Model(field).block(signals), signals


@pytest.mark.verifies(
    "emulator/signal/ionosphere/delay.py",
    "emulator/error_models/ionosphere.py",
    what="Ionosphere: code, carrier, rate; two craft",
    by=(
        "CODATA constant; 16 cm for a TECU on L1; second order left out, 2 cm at most; two craft 1 km apart: "
        "cancels by more than 1,000"
    ),
    status="validated",
)
def test_code_late_carrier_early_and_the_rate_is_the_carriers():
    field = of_coefficients(PRESETS["high"].coefficients, PRESETS["high"].profile)
    now, signals = at(0.0, field)
    antennas, sky = signals.epochs.antennas, signals.epochs.sky
    content = slant_tec_tecu(field, T_NS, antennas.pos_m[0, signals.receiver], sky.pos_ecef_m[0])
    assert now.range_m == pytest.approx(40.3082e16 * content * signals.wave_m**2 / LIGHT_MPS**2, rel=1e-4)
    assert (now.range_m > 0).all()
    assert now.phase_m == pytest.approx(-now.range_m)
    before, after = at(-0.5, field)[0], at(0.5, field)[0]
    assert now.rate_mps == pytest.approx(after.phase_m - before.phase_m, abs=2e-4)
    assert np.abs(now.rate_mps).max() > 2e-3
