"""Loop noise against simulated correlators and numbers worked by hand."""

import numpy as np
import pytest

from gnss_hil.emulator.error_models import thermal_noise
from gnss_hil.emulator.error_models.params_loops import Loops
from gnss_hil.emulator.numerics import keyed_draws

RNG = np.random.Generator(np.random.PCG64(20121031))


def correlators(cn0_hz, integration_s, count, correlation):
    """Complex noise of two correlators with unit power each and given correlation, and the signal's
    amplitude before the correlation function: power ratio 2 T C/N0 against one quadrature."""
    white = RNG.normal(size=(2, count, 2)) @ np.array([1, 1j])
    early = white[0]
    late = correlation * white[0] + np.sqrt(1 - correlation**2) * white[1]
    return np.sqrt(2 * cn0_hz * integration_s), early, late


@pytest.mark.parametrize(("cn0_dbhz", "spacing"), [(45, 0.5), (35, 0.5), (30, 1.0), (35, 0.1)])
def test_code_noise_is_that_of_the_power_discriminator(cn0_dbhz, spacing):
    """|E|^2 - |L|^2 over its slope, made a loop of noise bandwidth B by the factor 2 B T."""
    loop = Loops(code_bandwidth_hz=0.5, correlator_spacing_chips=spacing, integration_s=0.02)
    cn0_hz = 10 ** (cn0_dbhz / 10)
    amplitude, early, late = correlators(cn0_hz, loop.integration_s, 400_000, 1 - spacing)
    peak = amplitude * (1 - spacing / 2)
    output = np.abs(peak + early) ** 2 - np.abs(peak + late) ** 2
    slope = 4 * amplitude * peak  # |E|^2 falls by 2 A peak a chip, |L|^2 rises by as much
    simulated = output.std() / slope * np.sqrt(2 * loop.code_bandwidth_hz * loop.integration_s)
    assert thermal_noise.code_sigma_chips(cn0_hz, loop) == pytest.approx(simulated, rel=0.01)


@pytest.mark.parametrize("cn0_dbhz", [45, 35, 28])
def test_carrier_noise_is_that_of_the_costas_discriminator(cn0_dbhz):
    """I Q over its slope, made a loop of noise bandwidth B by the factor 2 B T."""
    loop = Loops(carrier_bandwidth_hz=15.0, integration_s=0.02)
    cn0_hz = 10 ** (cn0_dbhz / 10)
    amplitude, prompt, _ = correlators(cn0_hz, loop.integration_s, 400_000, 0.0)
    output = (amplitude + prompt.real) * prompt.imag
    simulated = output.std() / amplitude**2 * np.sqrt(2 * loop.carrier_bandwidth_hz * loop.integration_s)
    assert thermal_noise.carrier_sigma_rad(cn0_hz, loop) == pytest.approx(simulated, rel=0.01)


def test_numbers_by_hand():
    """C/N0 = 40 dBHz, T = 20 ms: code B = 0.5, D = 0.5: sqrt(1.25e-5 (1 + 2/300)) chips; carrier B = 15:
    sqrt(1.5e-3 (1 + 1/400)) rad; frequency B = 2: sqrt(8e-4 (1 + 1/200)) / (0.04 pi) Hz."""
    cn0_hz = 1e4
    assert thermal_noise.code_sigma_chips(cn0_hz, Loops()) == pytest.approx(3.5473e-3, rel=1e-4)
    assert np.rad2deg(thermal_noise.carrier_sigma_rad(cn0_hz, Loops())) == pytest.approx(2.2218, rel=1e-4)
    assert thermal_noise.doppler_sigma_hz(cn0_hz, Loops()) == pytest.approx(0.22564, rel=1e-4)


def test_every_factor_of_the_loops_disturbs_an_observable_of_its_own():
    raw = keyed_draws.grid(3, 4, 5, 1)[0, 0, :20]
    cn0, chip, wave = np.full(20, 42.0), np.full(20, 293.05), np.full(20, 0.19)
    disturbed = {}
    for name in thermal_noise.THERMAL:
        found = thermal_noise.errors([name], Loops(), raw, cn0, chip, wave)
        disturbed[name] = [
            field for field in ("range_m", "phase_m", "rate_mps") if getattr(found, field).any()
        ]
    assert disturbed == {
        "code_noise": ["range_m"],
        "carrier_noise": ["phase_m"],
        "doppler_noise": ["rate_mps"],
    }


def test_a_factor_does_not_change_what_others_draw():
    raw = keyed_draws.grid(3, 4, 5, 1)[0, 0, :20]
    cn0, chip, wave = np.full(20, 42.0), np.full(20, 293.05), np.full(20, 0.19)
    together = thermal_noise.errors(thermal_noise.THERMAL, Loops(), raw, cn0, chip, wave)
    alone = thermal_noise.errors(["doppler_noise"], Loops(), raw, cn0, chip, wave)
    assert (alone.rate_mps == together.rate_mps).all()
    assert not alone.range_m.any()
    assert not alone.phase_m.any()


def test_errors_have_the_sigma_of_their_loop():
    raw = np.concatenate([keyed_draws.grid(3, 4, epoch, 1)[0].reshape(-1, 4) for epoch in range(40)])
    n = len(raw)
    cn0, chip, wave = np.full(n, 40.0), np.full(n, 293.05), np.full(n, 0.1903)
    found = thermal_noise.errors(thermal_noise.THERMAL, Loops(), raw, cn0, chip, wave)
    sigma = (293.05 * 3.5473e-3, 0.1903 / 2 / np.pi * 0.038778, 0.1903 * 0.22564)
    for errors, expected in zip((found.range_m, found.phase_m, found.rate_mps), sigma, strict=True):
        assert errors.std() == pytest.approx(expected, rel=4 / np.sqrt(2 * n))
        assert abs(errors.mean()) < 4 * expected / np.sqrt(n)
