"""Structure in a run: what is hidden is not tracked, reflections disturb, by the craft's own file."""

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.receivers.emulated.channels import FULL, SLIPS
from gnss_hil.emulator.signal.structure import poses
from tests.emulator.signal.multipath.test_reception import RATE, TARGETS_MPS, attitude, sky
from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/signal/structure/poses.py",
    "emulator/signal/channel_geometry.py",
    what="Structure in a run",
    by="what is hidden is not tracked, reflections change ranges and levels where they must and nowhere else",
    status="modelled",
)


def soyuz(factors, structure="soyuz-ms"):
    return emulated.craft(
        receivers=emulated.QUICK, factors={**emulated.QUIET, **factors}, structure=structure
    )


def seen(factors, epochs=3):
    return emulated.epoch_at(emulated.world(soyuz(factors)), epochs)


def test_the_structure_hides_satellites_and_adds_none():
    free, shaded = seen({}), seen({"shadowing": True})
    assert (shaded.signal <= free.signal).all()
    assert shaded.signal.sum() < free.signal.sum()
    hidden = shaded.hidden
    assert np.array_equal(shaded.signal, free.signal & ~hidden)
    lossy = seen({"shadowing": True, "loss_of_lock": True})
    assert not lossy.held[lossy.hidden].any()


def station(factors, **tables):
    """The world of the station with its own four antennas."""
    antennas = vehicle.load(vehicle.find("iss-asn-m"))
    given = scenario.parse(
        emulated.document(soyuz(factors, "iss") | {"vehicle": "iss-asn-m.toml"}, **tables), "test"
    )
    return assemble.build_world(given, [antennas], 7)


def test_a_reflection_of_a_hidden_satellite_may_be_heard():
    epochs = range(200, 600, 20)

    def cn0(**factors):
        given = station({"link_budget": True, **factors}, interval_s=10.0)
        scenes = [emulated.epoch_at(given, epoch) for epoch in epochs]
        return scenes, np.array([scene.cn0_dbhz for scene in scenes])

    scenes, free = cn0()
    shaded, held = cn0(shadowing=True, multipath=True)
    dropped = cn0(shadowing=True, multipath={"hold_reflections": False})[1]
    hidden = [bare.signal & scene.hidden for bare, scene in zip(scenes, shaded, strict=True)]
    hidden = np.array(hidden)
    heard = hidden & np.isfinite(held)
    assert heard.any()
    assert (held[heard] < free[heard]).all()
    assert np.isneginf(dropped[hidden]).all()


@pytest.mark.slow
def test_a_loop_that_goes_over_to_a_reflection_tells_a_slip():
    """And when the direct ray comes back. Two reflected paths cannot be one count of cycles."""
    given = station({"shadowing": True, "multipath": True}, interval_s=10.0)
    units = [state.units[0] for state in emulated.run(given, 500)[0]]
    gone_over = 0
    for epoch in range(1, len(units)):
        before, after = units[epoch - 1].channels, units[epoch].channels
        hidden = [
            emulated.epoch_at(given, e).hidden[np.arange(4)[:, None], after.target]
            for e in (epoch - 1, epoch)
        ]
        stays = (before.lock == FULL) & (after.lock == FULL) & (before.target == after.target)
        moved = stays & (hidden[0] != hidden[1])
        assert (((after.slips - before.slips) % SLIPS)[moved] == 1).all()
        gone_over += np.count_nonzero(moved)
    assert gone_over >= 3


def test_reflections_reach_the_pseudoranges():
    """On the station; the Soyuz's antennas look past its structure."""

    def ranges(**factors):
        block = emulated.run(station(factors), 1)[1][0]
        return emulated.decode(block, "RANGE")["pseudorange_m"]

    off = np.abs(ranges() - ranges(multipath=True))
    assert 0.01 < off.max() < 30


def test_reflections_reach_the_reported_level():
    """Where reflections move the code they move the level, by tenths of a decibel and more; nowhere else."""

    def measured(**factors):
        block = emulated.run(station({"link_budget": True, **factors}), 1)[1][0]
        return emulated.decode(block, "RANGE")["pseudorange_m"], emulated.decode(block, "RATE")["cn0_dbhz"]

    (range_m, level_dbhz), (moved_m, moved_dbhz) = measured(), measured(multipath=True)
    off_m, off_db = np.abs(moved_m - range_m), np.abs(moved_dbhz - level_dbhz)
    assert (off_db[off_m == 0] == 0).all()
    assert 0.2 < off_db.max() < 6


def test_a_factor_without_a_structure_says_what_to_do():
    with pytest.raises(ScenarioError, match=r"craft\.soyuz\.factors\.multipath: needs .* structure = "):
        emulated.world(soyuz({"multipath": True}, structure=None))


def test_an_unknown_structure_is_told():
    with pytest.raises(
        ScenarioError, match=r"craft\.soyuz\.structure: structure 'mir': no such file; shipped"
    ):
        emulated.world(soyuz({"shadowing": True}, structure="mir"))


def test_directions_turn_as_differences_have_it():
    (before, _), (los, distance), (after, _) = (sky(t) for t in (-0.05, 0.0, 0.05))
    rate = poses.los_rate_body(los, TARGETS_MPS @ attitude(0.0).T, distance, RATE)
    np.testing.assert_allclose(rate, (after - before) / 0.1, atol=1e-9)
