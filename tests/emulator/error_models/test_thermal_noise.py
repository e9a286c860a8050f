"""Loop noise against simulated correlators and numbers worked by hand."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator.error_models import carrier_noise, code_noise, doppler_noise
from gnss_hil.emulator.error_models.base import CraftContext
from gnss_hil.emulator.signal import loops
from gnss_hil.emulator.signal.loops import Loops

pytestmark = pytest.mark.verifies(
    "emulator/signal/loops.py",
    "emulator/error_models/loop_noise.py",
    "emulator/error_models/code_noise.py",
    "emulator/error_models/carrier_noise.py",
    "emulator/error_models/doppler_noise.py",
    what="Loop noise",
    by=(
        "simulated early-minus-late and Costas correlators, 1 %; frequency loop by hand only; white from "
        "epoch to epoch, so for intervals of 1 s and more"
    ),
    status="validated",
)

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
    assert loops.code_sigma_chips(cn0_hz, loop) == pytest.approx(simulated, rel=0.01)


@pytest.mark.parametrize("cn0_dbhz", [45, 35, 28])
def test_carrier_noise_is_that_of_the_costas_discriminator(cn0_dbhz):
    """I Q over its slope, made a loop of noise bandwidth B by the factor 2 B T."""
    loop = Loops(carrier_bandwidth_hz=15.0, integration_s=0.02)
    cn0_hz = 10 ** (cn0_dbhz / 10)
    amplitude, prompt, _ = correlators(cn0_hz, loop.integration_s, 400_000, 0.0)
    output = (amplitude + prompt.real) * prompt.imag
    simulated = output.std() / amplitude**2 * np.sqrt(2 * loop.carrier_bandwidth_hz * loop.integration_s)
    assert loops.carrier_sigma_rad(cn0_hz, loop) == pytest.approx(simulated, rel=0.01)


def test_numbers_by_hand():
    """C/N0 = 40 dBHz, T = 20 ms: code B = 0.5, D = 0.5: sqrt(1.25e-5 (1 + 2/300)) chips; carrier B = 15:
    sqrt(1.5e-3 (1 + 1/400)) rad; frequency B = 2: sqrt(8e-4 (1 + 1/200)) / (0.04 pi) Hz."""
    cn0_hz = 1e4
    assert loops.code_sigma_chips(cn0_hz, Loops()) == pytest.approx(3.5473e-3, rel=1e-4)
    assert np.rad2deg(loops.carrier_sigma_rad(cn0_hz, Loops())) == pytest.approx(2.2218, rel=1e-4)
    assert loops.doppler_sigma_hz(cn0_hz, Loops()) == pytest.approx(0.22564, rel=1e-4)


ROWS = {row.ROW.name: row for row in (code_noise, carrier_noise, doppler_noise)}
SHAPE = 40, 8, 60  # epochs, receivers, satellites
CONTEXT = CraftContext(
    3, 4, 0, 10**9, (0, 10**9), np.arange(64), Path, vehicle.load(vehicle.find("soyuz-ms")), Loops()
)


def disturbed(name):
    """What a row adds to signals of 40 dBHz of all receivers and satellites in some epochs."""
    epoch, receiver, sat = (column.reshape(-1) for column in np.indices(SHAPE))
    n = len(sat)
    signals = SimpleNamespace(
        epoch=epoch, receiver=receiver, sat=sat, cn0_dbhz=np.full(n, 40.0), chip_m=np.full(n, 293.05),
        wave_m=np.full(n, 0.1903), signal=0 * sat,
    )  # fmt: skip
    row = ROWS[name].ROW
    return row.build(row.params(), CONTEXT).block(signals)


@pytest.mark.parametrize(
    ("name", "observable", "sigma"),
    [
        ("code_noise", "range_m", 293.05 * 3.5473e-3),
        ("carrier_noise", "phase_m", 0.1903 / 2 / np.pi * 0.038778),
        ("doppler_noise", "rate_mps", 0.1903 * 0.22564),
    ],
)
def test_each_disturbs_one_observable_with_the_sigma_of_its_loop(name, observable, sigma):
    found = disturbed(name)
    others = {"range_m", "phase_m", "rate_mps"} - {observable}
    assert not any(np.any(getattr(found, other)) for other in others)
    errors = getattr(found, observable)
    assert errors.std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * len(errors)))
    assert abs(errors.mean()) < 4 * sigma / np.sqrt(len(errors))


def test_rows_do_not_draw_the_same():
    standard = [
        getattr(disturbed(name), observable)
        for name, observable in (
            ("code_noise", "range_m"),
            ("carrier_noise", "phase_m"),
            ("doppler_noise", "rate_mps"),
        )
    ]
    apart = np.corrcoef(standard)[np.triu_indices(3, 1)]
    assert np.abs(apart).max() < 4 / np.sqrt(len(standard[0]))
