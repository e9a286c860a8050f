"""Observations before they are rounded for the bus: rate against the derivative of range."""

import numpy as np

from gnss_hil.emulator.environment.signals import signals
from gnss_hil.emulator.receivers.emulated.channels import FULL, fresh_channels
from tests.support import emulated

INTERVAL_S = 0.25


def observations(clock):
    """Five epochs of the same 24 satellites and antennas, noise off."""
    soyuz = emulated.craft(receivers=emulated.QUICK, factors=emulated.QUIET, clock=clock)
    the_world = emulated.world(soyuz, interval_s=INTERVAL_S)
    chosen = emulated.run(the_world, 1)[0][0].units[0].channels
    receiver, channel = np.nonzero(chosen.lock == FULL)
    row, craft = chosen.target[receiver, channel], the_world.craft[0]
    out = []
    for epoch in range(5):
        prepared, k = craft.prepared(epoch)
        at = np.full(len(row), k)
        out.append(signals(craft.environment, prepared.block, at, receiver, row))
    return out


def test_range_rate_is_the_derivative_of_pseudorange():
    """Orbit, Earth rotation, lever arms on a turning body, both clocks and relativity at once. The rate of
    the Shapiro delay (1e-5 m/s) is the only thing left out; the bus resolves 1e-4."""
    seen = observations({"amplitude_ms": 1.0, "period_s": 5400})
    p = [s.pseudorange_m for s in seen]
    difference = (8 * (p[3] - p[1]) - (p[4] - p[0])) / (12 * INTERVAL_S)
    assert len(difference) == 24
    assert np.abs(difference - seen[2].range_rate_mps).max() < 2e-5


def test_receiver_clock_enters_range_and_rate_alone():
    still, moving = observations({"amplitude_ms": 0.0}), observations({"amplitude_ms": 1.0})
    apart = np.array([m.pseudorange_m - s.pseudorange_m for m, s in zip(moving, still, strict=True)])
    assert np.ptp(apart, axis=1).max() < 1e-6  # one domain: the same in every channel
    assert np.abs(apart).max() > 1e3
    for m, s in zip(moving, still, strict=True):
        assert (m.clock_m == s.clock_m).all()
        assert np.abs(m.pos_ecef_m - s.pos_ecef_m).max() == 0


def test_nothing_is_observed_by_idle_channels():
    channels = fresh_channels(emulated.VEHICLE.channels)
    assert not (channels.lock == FULL).any()
    block = emulated.run(emulated.world(emulated.craft()), 1)[1][0]
    assert len(emulated.channels(block)["sat"]) == 0
    assert emulated.decode(block, "STATUS")["frames"].tolist() == [1, 1, 1, 1]
