"""What carrier loops remember, in whole runs: wind-up is phase alone, slips are counted and stay."""

import numpy as np
import pytest

from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/receivers/emulated/phase.py",
    what="Carrier phases in a run: wind-up, slips, half cycles",
    by="rates and phases of a craft that yaws agree; slips are counted until a preamble as in the messages",
    status="modelled",
)


def phases(factors, epochs=12):
    """Phases, slips and half-cycle doubts (epochs, channels) by receiver and channel; ranges."""
    craft = emulated.craft(receivers=emulated.QUICK, factors={**emulated.QUIET, **factors})
    _, blocks, _ = emulated.run(emulated.world(craft), epochs)
    seen = [emulated.decode(block, "PHASE") for block in blocks]
    sent = [np.array([b[name] for b in seen]) for name in ("phase_cyc", "slips", "half_cycle")]
    return *sent, np.array([emulated.decode(block, "RANGE")["pseudorange_m"] for block in blocks])


def test_windup_changes_phases_by_little_and_smoothly_and_ranges_not_at_all():
    plain, turned = phases({}), phases({"phase_windup": True})
    assert np.array_equal(plain[3], turned[3])
    off = turned[0] - plain[0]
    assert np.abs(off - np.rint(off)).max() > 0.001
    assert np.abs(np.diff(off, axis=0)).max() < 0.05, "cycles in a second: an orbit turns once in 93 minutes"


def test_windup_turns_the_phase_as_it_changes_the_rate():
    """A craft that yaws by 60 deg in 20 s: cycles of the carrier on the bus are metres of its rate."""
    yawing = {"attitude": {"mode": "slew", "profile": [{"t_s": 0.0}, {"t_s": 20.0, "yaw_deg": 60.0}]}}
    plain, turned = (
        [
            emulated.channels(block)
            for block in emulated.run(
                emulated.world(
                    emulated.craft(receivers=emulated.QUICK, factors={**emulated.QUIET, **factors}, **yawing)
                ),
                14,
            )[1]
        ]
        for factors in ({}, {"phase_windup": True})
    )
    stays = np.ptp([block["sat"] for block in plain], axis=0) == 0
    glonass = plain[0]["sat_system"] == 1
    wave_m = 299_792_458 / np.where(glonass, 1602e6 + 562.5e3 * plain[0]["frequency"], 1575.42e6)
    off_cyc, off_mps = (
        np.array([b[name] - a[name] for a, b in zip(plain, turned, strict=True)])
        for name in ("phase_cyc", "range_rate_mps")
    )
    turns = np.unwrap(off_cyc, axis=0, period=1.0)
    by_phase = (turns[8:] - turns[6:-2])[:5] / 2 * wave_m
    assert np.abs(by_phase - off_mps[7:12])[:, stays].max() < 3e-4
    assert np.abs(off_mps[9, stays]).min() > 1e-3


def test_slips_are_counted_and_half_ones_stay_in_doubt_until_a_preamble():
    """A subframe of GPS begins every 6 s, a string of GLONASS every 2 s; then a phase is whole again."""
    plain, slipped = (phases(f, 30) for f in ({}, {"cycle_slips": {"per_hour": 600.0}}))
    off = slipped[0] - plain[0]
    halves = np.rint(2 * off).astype(int)
    assert np.abs(2 * off - halves).max() < 0.01
    assert halves.any()
    goes_on = np.diff(plain[1].astype(int), axis=0) == 0  # where the channel has not begun another phase
    moved = (np.diff(halves, axis=0) != 0) & goes_on
    counted = np.diff(slipped[1].astype(int), axis=0) % 16
    assert ((counted != 0) | ~moved).all()
    assert np.mean(moved[counted != 0]) > 0.9, "a doubt may end while another slip puts its half cycle back"
    assert np.array_equal(halves % 2 == 1, slipped[2] == 1)
    assert slipped[2].any() and not plain[2].any()
    for epoch in range(6, len(halves)):
        old = slipped[2][epoch - 6 : epoch + 1].all(axis=0)
        assert (counted[epoch - 6 : epoch] != 0)[:, old].any(axis=0).all(), "six seconds without a preamble"


def test_whole_slips_leave_no_doubt():
    assert not phases({"cycle_slips": {"per_hour": 3600.0, "costas": False}})[2].any()
