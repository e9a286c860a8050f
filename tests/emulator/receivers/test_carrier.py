"""What carrier loops remember, in whole runs: wind-up is phase alone, slips are counted and stay."""

import numpy as np

from tests.emulator import bench


def phases(factors, epochs=12):
    """Phases and ranges of all epochs, by receiver and channel; slips of the last."""
    craft = bench.craft(receivers=bench.QUICK, factors={**bench.QUIET, **factors})
    _, blocks, _ = bench.run(bench.world(craft), epochs)
    kinds = [[bench.decode(block, kind) for block in blocks] for kind in ("PHASE", "RANGE", "RATE")]
    phase = np.array([b["phase_cyc"] for b in kinds[0]])
    return phase, np.array([b["pseudorange_m"] for b in kinds[1]]), kinds[0][-1]["slips"], kinds[2]


def test_windup_changes_phases_by_little_and_smoothly_and_ranges_not_at_all():
    plain, wound = phases({}), phases({"phase_windup": True})
    assert np.array_equal(plain[1], wound[1])
    off = wound[0] - plain[0]
    assert np.abs(off - np.rint(off)).max() > 0.001
    assert np.abs(np.diff(off, axis=0)).max() < 0.05, "cycles in a second: an orbit turns once in 93 minutes"


def test_slips_move_phases_by_half_cycles_for_good():
    plain, slipped = phases({}), phases({"cycle_slips": {"per_hour": 600.0}})
    off = slipped[0] - plain[0]
    assert np.abs(2 * off - np.rint(2 * off)).max() < 0.01
    assert np.abs(off).max() >= 0.5
    stepped = np.abs(np.diff(off, axis=0)) > 0.25
    counted = (slipped[2] - plain[2]) % 16
    assert np.array_equal(stepped.sum(axis=0), counted)
