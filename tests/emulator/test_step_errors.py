"""Errors of clock and attitude on the bus, judged by kinematics: where a craft was, and how it turned."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.emulator.test_step import OMEGA, ROUNDING_M, predicted_range_m
from tests.support import emulated

pytestmark = pytest.mark.verifies(what="Error models in a run")


def played(epochs, **factors):
    craft = emulated.craft(receivers=emulated.QUICK, factors={**emulated.QUIET, **factors})
    return emulated.run(emulated.world(craft), epochs)[1:]


def test_receivers_latch_before_a_mark_that_a_fast_clock_gives():
    """Its computer 2 ms ahead, a craft is where it was 2 ms before the mark: 15 m behind."""
    blocks, truths = played(2, onboard_clock={"offset_us": 2000.0, "drift_ppb": 0.0, "walk": 0.0})
    before = {name: truths[1][name] for name in truths[1].dtype.names}
    before["position_ecef_m"] = truths[1]["position_ecef_m"] - 2e-3 * truths[1]["velocity_ecef_mps"]
    seen = emulated.channels(blocks[1])
    # Gravity bends the way by 20 um; the bus rounds.
    assert np.abs(seen["pseudorange_m"] - predicted_range_m(seen, before)).max() < ROUNDING_M + 1e-4
    # The contract's tag is the receiver's clock minus the mark, by steps of 100 ns.
    off_ns = emulated.decode(blocks[1], "TAG")["tag_offset_ns"] - 1e9 * truths[1]["clock_s"][0]
    assert off_ns == pytest.approx(np.full(4, -2e6), abs=101)


def test_a_reported_attitude_turns_at_the_reported_rate():
    """With gyros alone, 100 deg/h off: what is reported is what their rates make, relative to the stars."""
    blind = {"star_interval_s": 0.0, "initial_drift_deg_h": 100.0, "initial_deg": 0.0}
    quiet = {"angle_walk_deg_rth": 0.0, "drift_walk_deg_h_rth": 0.0}
    blocks, truths = played(12, attitude_error={**blind, **quiet})
    axes, rate = [], []
    for block in blocks:
        one, two, turn = (emulated.decode(block, kind) for kind in ("ATT_Q01", "ATT_Q23", "ATT_RATE"))
        # A passive quaternion of body from ECEF is, as an active one, the turn of the axes into the body's.
        axes.append(Rotation.from_quat([one["q1"][0], two["q2"][0], two["q3"][0], one["q0"][0]]))
        rate.append([turn[name][0] for name in ("wx_rps", "wy_rps", "wz_rps")])
    turned_rps = (axes[0].inv() * axes[10]).as_rotvec() / 10
    told_rps = np.mean(rate[1:11], axis=0)
    earth_rps = axes[5].inv().apply([0.0, 0.0, OMEGA])
    assert turned_rps == pytest.approx(told_rps - earth_rps, abs=5e-6)  # the bus has steps of 4e-6 rad/s
    assert np.abs(told_rps - truths[5]["rate_body_rps"]).max() > 1e-4
