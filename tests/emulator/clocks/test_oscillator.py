"""Receiver oscillators: covariance by matrix exponential, Allan deviation by an independent library."""

from __future__ import annotations

import allantools
import numpy as np
import pytest
from scipy.linalg import expm

from gnss_hil.emulator.clocks import oscillator
from gnss_hil.emulator.clocks.bounded_wander import DOMAINS
from gnss_hil.emulator.clocks.oscillator import OSCILLATORS
from gnss_hil.emulator.error_models.clock_instability import ClockInstability, running

pytestmark = pytest.mark.verifies(
    "emulator/clocks/oscillator.py",
    "emulator/error_models/clock_instability.py",
    what="Free receiver oscillators",
    by=(
        "Allan deviation by allantools against the densities, 3 %; covariance of a step by matrix "
        "exponential. No flicker of frequency"
    ),
    status="validated",
)


@pytest.mark.parametrize("dt_s", [0.01, 1.0, 60.0])
def test_what_a_step_adds_has_the_exact_covariance(dt_s):
    """Van Loan's method: IEEE Trans. Automatic Control 23 (1978) 395."""
    white, walk = 1e-21, 4e-19
    f = np.array(((0.0, 1.0), (0.0, 0.0)))
    block = expm(dt_s * np.block([[-f, np.diag((white, walk))], [np.zeros((2, 2)), f.T]]))
    covariance = block[2:, 2:].T @ block[:2, 2:]
    added = oscillator.spread(white, walk, dt_s)
    assert added @ added.T == pytest.approx(covariance, rel=1e-12, abs=0)


@pytest.mark.parametrize("name", list(OSCILLATORS))
def test_allan_deviation_is_that_of_the_densities(name):
    """sigma^2 = h0 / (2 tau) + 2 pi^2 h-2 tau / 3 (IEEE Std 1139-2008, annex B), by allantools."""
    rng, state, phase = np.random.default_rng(4), np.zeros((2, 400)), []
    for _ in range(1200):
        phase.append(state[0])
        state = oscillator.advance(OSCILLATORS[name], state, rng.normal(size=(400, 2)), 10.0)
    taus = np.array((10.0, 100.0, 1000.0))
    variance = np.mean(
        [allantools.oadev(row, rate=0.1, data_type="phase", taus=taus)[1] ** 2 for row in np.array(phase).T],
        axis=0,
    )
    h0, hm2 = OSCILLATORS[name].h0, OSCILLATORS[name].hm2
    assert np.sqrt(variance) == pytest.approx(
        np.sqrt(h0 / (2 * taus) + 2 * np.pi**2 * hm2 * taus / 3), rel=0.03
    )


def test_chip_scale_clock_is_that_of_its_data_sheet():
    """SA.45s: 3e-10 over 1 s, 1e-11 over 1000 s."""
    csac = OSCILLATORS["csac"]
    assert np.sqrt(csac.h0 / 2) == pytest.approx(3e-10, rel=1e-6)
    assert np.sqrt(csac.h0 / 2000) == pytest.approx(1e-11, rel=0.06)


def run(parameters, epochs, seed=1, key=2, interval_ns=10**9):
    clocks, state, states = running(parameters, seed, key, interval_ns), None, []
    for epoch in range(epochs):
        state = clocks(state, epoch)
        states.append(state)
    return np.array(states)


def test_domains_begin_as_said_and_run_apart():
    first = np.concatenate([run(ClockInstability(), 1, seed)[0] for seed in range(300)], axis=1)
    assert first[0].std() == pytest.approx(1e-4, rel=0.05)
    assert first[1].std() == pytest.approx(20e-9, rel=0.05)
    states = run(ClockInstability(), 50)
    assert states.shape == (50, 2, DOMAINS)
    assert (run(ClockInstability(), 50) == states).all()
    assert len(np.unique(states[-1])) == 2 * DOMAINS
    assert np.diff(states[:, 0], axis=0) == pytest.approx(states[:-1, 1], abs=6 * 3.7e-10)


def test_a_receiver_may_set_its_clock_back():
    """1 ms steps, as receivers do; the frequency is what it was."""
    drifting = ClockInstability(offset_ms=0.4, frequency_ppb=2000, reset_ms=1.0)
    states, free = run(drifting, 600), run(drifting.model_copy(update={"reset_ms": 0.0}), 600)
    assert np.abs(states[:, 0]).max() <= 0.5e-3
    apart = (free[:, 0] - states[:, 0]) / 1e-3
    assert apart == pytest.approx(np.rint(apart), abs=1e-6)
    assert len(np.unique(np.rint(apart))) > 2
    assert (states[:, 1] == free[:, 1]).all()
