"""What snapshot navigators keep from epoch to epoch: the orbit, propagated while that is worth anything."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.flightsw.estimation.snapshot import MAX_COAST_S, Snapshot, coasted
from gnss_hil.flightsw.orbit.propagator import propagate
from gnss_hil.flightsw.records.solution import OrbitState
from tests.flightsw.estimation.test_position import craft
from tests.support import synthetic_epochs as s

POSITION, VELOCITY = s.truth_ecef(craft())


def orbit(velocity=VELOCITY):
    return OrbitState(s.T0_NS, POSITION, velocity, 3)


@pytest.mark.parametrize(
    ("dt_s", "known"),
    [(0.0, True), (1.0, True), (3600.0, True), (3600.1, False), (90_000.0, False), (-1.0, False)],
)
def test_a_position_is_forgotten_after_an_hour(dt_s, known):
    now = coasted(orbit(), s.T0_NS + round(dt_s * 1e9))
    assert MAX_COAST_S == 3600.0 and (now is not None) == known
    if known:
        position, velocity = propagate(POSITION, VELOCITY, dt_s)
        assert np.array_equal(now.position_m, position) and np.array_equal(now.velocity_mps, velocity)
        assert (now.t_ns, now.age) == (s.T0_NS + round(dt_s * 1e9), 4)


def test_a_position_without_velocity_is_forgotten_at_once():
    assert coasted(orbit(None), s.T0_NS + 10**9) is None and coasted(None, s.T0_NS) is None


def test_the_search_starts_where_the_craft_is_expected():
    assert Snapshot().start_m is None
    assert np.array_equal(Snapshot(orbit()).start_m, POSITION)
