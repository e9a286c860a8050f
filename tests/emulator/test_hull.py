"""Structure in a run: what is hidden is not tracked, reflections disturb, by the craft's own file."""

import numpy as np
import pytest

from dbc import vehicle
from emulator import build, scenario
from emulator.scenario import ScenarioError
from tests.emulator import bench


def soyuz(factors, structure="soyuz-ms"):
    return bench.craft(receivers=bench.QUICK, factors={**bench.QUIET, **factors}, structure=structure)


def seen(factors, epochs=3):
    return bench.scene_at(bench.world(soyuz(factors)), epochs)


def test_the_structure_hides_satellites_and_adds_none():
    free, shaded = seen({}), seen({"shadowing": True})
    assert (shaded.signal <= free.signal).all()
    assert shaded.signal.sum() < free.signal.sum()
    hidden = shaded.around.hidden
    assert np.array_equal(shaded.signal, free.signal & ~hidden)
    assert not shaded.held[hidden].any()


def test_a_reflection_of_a_hidden_satellite_may_be_heard():
    held = seen({"shadowing": True, "multipath": True})
    dropped = seen({"shadowing": True, "multipath": {"hold_reflections": False}})
    assert (dropped.signal <= held.signal).all()
    late = held.signal & held.around.hidden
    assert (held.cn0_dbhz[late] < dropped.view.distance_m.max()).all()
    assert np.isneginf(dropped.cn0_dbhz[dropped.around.hidden & (dropped.cn0_dbhz < 0)]).all()


def test_reflections_reach_the_pseudoranges():
    """On the station; the Soyuz's antennas look past its structure."""
    station = vehicle.load(vehicle.find("iss-asn-m"))

    def ranges(**factors):
        craft = soyuz(factors, "iss") | {"vehicle": "iss-asn-m.toml"}
        given = scenario.parse(bench.document(craft), "test")
        block = bench.run(build.build_world(given, [station], 7), 1)[1][0]
        return bench.decode(block, "RANGE")["pseudorange_m"]

    off = np.abs(ranges() - ranges(multipath=True))
    assert 0.01 < off.max() < 30


def test_a_factor_without_a_structure_says_what_to_do():
    with pytest.raises(ScenarioError, match=r"craft\.soyuz\.factors\.multipath: needs .* structure = "):
        bench.world(soyuz({"multipath": True}, structure=None))


def test_an_unknown_structure_is_told():
    with pytest.raises(
        ScenarioError, match=r"craft\.soyuz\.structure: structure 'mir': no such file; shipped"
    ):
        bench.world(soyuz({"shadowing": True}, structure="mir"))
