"""The frame budget: the worst frame there is, and a bus that would overflow."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.tools.run_config.frame_budget import WORST_BITS, budget, typical_bits


@pytest.mark.verifies(
    "tools/run_config/frame_budget.py",
    what="Frame budget",
    by="135 bits at most (Nolte et al., 2001); no epoch of a run has more frames or bits than foreseen",
    status="validated",
)
def test_worst_frame_is_the_worst_there_is():
    """Five equal bits, then alternating fours: the published worst case of 24 stuff bits (Nolte et al., 2001:
    an 8-byte base frame has at most 135 bits with intermission)."""
    assert WORST_BITS == 135
    draw = np.random.default_rng(1)
    random = batch(draw.integers(0, 0x800, 5000), draw.integers(0, 256, (5000, 8)))
    pattern = batch(np.full(256, 0x078), np.tile(np.arange(256)[:, None], 8))
    assert frame_bits(random).max() <= WORST_BITS
    assert WORST_BITS - 4 <= frame_bits(pattern).max() <= WORST_BITS
    assert 111 < typical_bits() < WORST_BITS


def test_budget_refuses_above_the_limit_with_the_numbers():
    craft = vehicle.load(vehicle.find("soyuz-ms"))
    fits, full = (budget(craft, interval_s, 54, 20.0) for interval_s in (1.0, 0.05))
    assert fits.refusal("soyuz") is None
    assert fits.worst_percent == pytest.approx(100 * fits.frames(True) * 135 / 1e6)
    assert "soyuz: the bus would overflow" in full.refusal("soyuz")
    assert f"{full.worst_percent:.0f} %" in full.refusal("soyuz")
