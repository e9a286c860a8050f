"""The on-board computer's clock: its walk by an independent library."""

from __future__ import annotations

import allantools
import numpy as np
import pytest

from gnss_hil.emulator.error_models.onboard_clock import OnboardClock, showing

pytestmark = pytest.mark.verifies(
    "emulator/clocks/onboard_clock.py",
    "emulator/error_models/onboard_clock.py",
    what="On-board computer's clock",
    by="Allan deviation by allantools, 5 %",
    status="validated",
)

S = 10**9


def test_offset_and_drift():
    """5 us ahead, 2e-8 fast: 77 us ahead after an hour."""
    clock = showing(OnboardClock(offset_us=5.0, drift_ppb=20.0, walk=0.0), 1, 2, 10 * S)
    assert clock(0) == pytest.approx(5e-6)
    assert clock(360) == pytest.approx(77e-6)


def test_allan_deviation_of_the_walk():
    """White noise of frequency: 1e-9 at 1 s, falling with the square root of time; across hours too."""
    parameters = OnboardClock(walk=1e-9)
    taus, variance = np.array((1.0, 10.0, 100.0)), []
    for seed in range(5):
        clock = showing(parameters, seed, 2, S)
        phase = [clock(epoch) for epoch in range(10_000)]
        variance.append(allantools.oadev(np.array(phase), rate=1.0, data_type="phase", taus=taus)[1] ** 2)
    assert np.sqrt(np.mean(variance, axis=0)) == pytest.approx(1e-9 / np.sqrt(taus), rel=0.05)


def test_the_clock_depends_on_the_time_alone():
    parameters = OnboardClock()
    forwards, backwards, fine = (showing(parameters, 1, 2, interval) for interval in (S, S, S // 4))
    times = (0, 3, 3599, 3600, 3601, 20_000)
    values = [forwards(t) for t in times]
    assert [backwards(t) for t in reversed(times)] == values[::-1]
    assert [fine(4 * t) for t in times] == values
    assert fine(13) == pytest.approx(0.75 * fine(12) + 0.25 * fine(16), abs=1e-18)
    assert showing(parameters, 1, 3, S)(3600) != values[3]
