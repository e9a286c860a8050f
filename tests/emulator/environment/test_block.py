"""Blocks of the environment: functions of the epoch alone, whatever was asked before, of whom and how."""

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.environment.block import EPOCHS, build_block, epochs_at
from gnss_hil.emulator.step import emulate_step, prepare_step
from tests.support import emulated

WALKING = {"clock_instability": True, "attitude_error": True, "onboard_clock": True}


def craft(interval_s=1.0, epochs=600, **factors):
    soyuz = emulated.craft(receivers=emulated.QUICK, factors=factors)
    time = {
        "start_gps": "2012-10-31T00:15:00",
        "duration_s": epochs * interval_s,
        "epoch_interval_s": interval_s,
    }
    return emulated.world(soyuz, time=time).craft[0]


def walked(block):
    """What walks from epoch to epoch, and what follows of it."""
    at = block.geometry
    return at.clock, at.t_ns, block.reported.angle_rad, block.reported.rate_rps, at.state.pos_ecef_m


def test_a_block_asked_out_of_order_is_the_same():
    ordered, jumped = craft(**WALKING).environment, craft(**WALKING).environment
    first = [0, EPOCHS, 2 * EPOCHS, 3 * EPOCHS]
    expected = {number: walked(build_block(ordered, number)) for number in first}
    for number in (3 * EPOCHS, 0, 2 * EPOCHS, EPOCHS, EPOCHS):
        for found, known in zip(walked(build_block(jumped, number)), expected[number], strict=True):
            assert np.array_equal(found, known)


def test_states_walk_on_from_block_to_block():
    """As far from the last epoch of one block to the first of the next as between two within."""
    env = craft(**WALKING).environment
    one, next_one = (build_block(env, number) for number in (0, EPOCHS))
    clock_s = np.concatenate([b.geometry.clock[:, 0] for b in (one, next_one)])
    rate = np.concatenate([b.geometry.clock[:, 1] for b in (one, next_one)])
    left = np.abs(np.diff(clock_s, axis=0) - rate[:-1])
    assert left[EPOCHS - 1].max() < 4 * left.max(axis=1).mean()


def test_the_last_block_ends_with_the_run():
    env = craft(epochs=100).environment
    assert env.span(0) == (0, 64)
    assert env.span(99) == (64, 100)
    assert env.span(100) == (100, 128)  # nothing asks for it in a run
    assert len(build_block(env, 64).geometry) == 36


@pytest.mark.parametrize(("period_s", "epochs"), [(None, 64), (10.0, 64), (1.0, 64), (0.1, 6), (0.001, 4)])
def test_a_fast_pace_makes_short_blocks(period_s, epochs):
    assert epochs_at(period_s) == epochs


def played(period_s, ahead):
    """Frames and truth of ninety epochs with two commands' worth of search, at blocks of a pace."""
    soyuz = emulated.craft(receivers=emulated.QUICK, factors=WALKING)
    given = scenario.parse(emulated.document(soyuz), "test")
    world = assemble.build_world(given, [vehicle.load(vehicle.find("soyuz-ms"))], 7, period_s=period_s)
    state, out = assemble.initial_state(world), []
    for epoch in range(90):
        if ahead:
            prepare_step(world, state, epoch)
        state, frames, truth = emulate_step(world, state, {}, epoch)
        out.append((frames["soyuz"].data.tobytes(), truth.tobytes()))
    return out


def test_blocks_of_any_size_and_work_done_ahead_give_the_same_bytes():
    assert played(0.1, ahead=True) == played(None, ahead=False)


def test_what_a_signal_says_does_not_depend_on_what_else_is_tracked():
    """Amid reflections, electrons and noise: a pair asked for alone, after others, and with them."""
    factors = {"multipath": True, "shadowing": True, "cycle_slips": True, "phase_windup": True}
    station = emulated.craft(
        receivers=emulated.QUICK, factors=factors, structure="iss", vehicle="iss-asn-m.toml"
    )
    given = scenario.parse(emulated.document(station, sky={"factors": {"ionosphere": True}}), "test")
    loaded = [vehicle.load(vehicle.find("iss-asn-m"))]

    def prepared():
        return assemble.build_world(given, loaded, 7).craft[0].prepared(0)[0]

    many, few = prepared(), prepared()
    pairs = np.stack(many.block.signal.any(axis=0).nonzero())
    together = dict(zip(map(tuple, pairs.T.tolist()), many.rows(*pairs).tolist(), strict=True))
    for pair in list(together)[::7]:
        alone = int(few.rows(*np.array(pair)[:, None])[0])
        for name in ("words", "cycles", "turns_cyc", "half_cycles", "arc", "cn0_dbhz"):
            ours, theirs = (
                getattr(p.columns(), name)[first : first + EPOCHS]
                for p, first in ((few, alone), (many, together[pair]))
            )
            if ours.dtype == np.float64:
                np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6)
            else:
                assert np.array_equal(ours, theirs), name
