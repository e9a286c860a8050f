"""Cycle slips against simulated loops and the Fokker-Planck equation; thresholds worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad

from gnss_hil.emulator.error_models.cycle_slips import CycleSlips, slips
from gnss_hil.emulator.error_models.loss_of_lock import LossOfLock, holds
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.signal.loops import Loops, slip_rate_hz

pytestmark = pytest.mark.verifies(
    "emulator/error_models/cycle_slips.py",
    "emulator/error_models/loss_of_lock.py",
    what="Cycle slips, loss of lock",
    by=(
        "first passage of the Fokker-Planck equation by quadrature, 1e-7; simulated loops with sine and "
        "double sine, 6 %; thresholds by hand. Loops of first order"
    ),
    status="validated",
)


@pytest.mark.parametrize("snr", [0.5, 2.0, 5.0])
def test_mean_time_is_the_first_passage_of_the_fokker_planck_equation(snr):
    """dphi = -K sin(phi) dt + sqrt(2 D) dW, K = 4 B, D = K / snr, from 0 to 2 pi on either side: by
    quadrature. Risken, The Fokker-Planck Equation, 8.1"""
    gain = 4 * 10.0

    def density(before, phase):
        return np.exp(snr * (np.cos(before) - np.cos(phase)))

    mean_s = snr / gain * dblquad(density, 0, 2 * np.pi, 0, lambda phase: phase, epsrel=1e-10)[0]
    assert slip_rate_hz(snr, 10.0) == pytest.approx(1 / mean_s, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("costas", [False, True])
def test_simulated_loops_slip_as_often(costas):
    """Loops of first order with a sine (or a Costas loop's double sine) in noise, bandwidth 15 Hz, 20 dBHz
    with an integration long enough that squaring costs nothing: rate and size of slips."""
    order, bandwidth_hz = (2, 15.0) if costas else (1, 15.0)
    cn0_dbhz = 10 * np.log10(bandwidth_hz * 2.0 * order**2)  # loop SNR 2
    parameters = CycleSlips(costas=costas)
    loops = Loops(carrier_bandwidth_hz=bandwidth_hz, integration_s=1.0, other_jitter_deg=0.0)
    variance = bandwidth_hz / 10 ** (cn0_dbhz / 10) * (1 + 1 / (2 * 10 ** (cn0_dbhz / 10)))
    gain, dt = 4 * bandwidth_hz, 2e-4
    rng, phase, count = np.random.default_rng(8), np.zeros(4000), 0
    settling, steps = 1500, 8000
    for step in range(settling + steps):
        noise = np.sqrt(2 * gain * variance * dt) * rng.standard_normal(len(phase))
        phase += noise - gain * dt * np.sin(order * phase) / order
        over = np.abs(phase) > 2 * np.pi / order
        count += np.count_nonzero(over) if step >= settling else 0
        phase[over] = 0.0
    simulated_hz = count / (steps * dt * len(phase))
    raw = Stream(1, 2, "cycle_slips").words(3, 100_000)
    found = slips(parameters, loops, raw, np.full(len(raw), cn0_dbhz), 1.0)
    assert np.mean(found != 0) == pytest.approx(-np.expm1(-simulated_hz), rel=0.06)
    assert set(np.unique(found).tolist()) == ({-1, 0, 1} if costas else {-2, 0, 2})
    assert abs(found.sum()) < 5 * np.sqrt((found**2).sum())


def test_strong_signals_never_slip():
    raw = Stream(1, 2, "cycle_slips").words(3, 10_000)
    assert not slips(CycleSlips(), Loops(), raw, np.full(len(raw), 40.0), 60.0).any()
    assert np.isfinite(slip_rate_hz(np.array((1e-3, 1e5)), 15.0)).all()


def test_a_rate_may_be_added():
    raw = Stream(1, 2, "cycle_slips").words(3, 200_000)
    found = slips(CycleSlips(per_hour=360), Loops(), raw, np.full(len(raw), 45.0), 1.0)
    assert np.mean(found != 0) == pytest.approx(-np.expm1(-0.1), rel=0.02)


def test_thresholds_by_hand():
    """Carrier, B = 15 Hz, T = 20 ms: 15/c (1 + 25/c) = (pi/12)^2 at c = 241.5 Hz, 23.83 dBHz. Code, B = 0.5
    Hz, D = 0.5: 0.125/c (1 + 66.7/c) = (1/12)^2 at c = 44.8 Hz, 16.51 dBHz."""
    quiet = Loops(other_jitter_deg=0.0)
    assert holds(LossOfLock(), quiet, np.array((23.82, 23.84))).tolist() == [False, True]
    code_only = Loops(other_jitter_deg=0.0, carrier_bandwidth_hz=0.1)
    assert holds(LossOfLock(), code_only, np.array((16.50, 16.52))).tolist() == [False, True]


def test_stress_costs_signal():
    """15 deg of steady error leave 10 deg of jitter: c from 15/c (1 + 25/c) = (pi/18)^2 is 516.7 Hz,
    27.13 dBHz."""
    stressed, still = LossOfLock(stress_deg=15.0), Loops(other_jitter_deg=0.0)
    assert holds(stressed, still, np.array(((27.12,), (27.15,)))).tolist() == [[False], [True]]
    assert not holds(LossOfLock(), Loops(other_jitter_deg=15.0), np.array((50.0,)))[0]
    assert not holds(LossOfLock(stress_chips=0.25), Loops(), np.array((50.0,)))[0]
