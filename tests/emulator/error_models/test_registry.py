"""Every factor of the registry, switched on by itself, changes what is on the bus: none is a switch alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator import assemble
from gnss_hil.emulator.assemble.shared import models_of
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.error_models.base import Fixed, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.checked import ModelError
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.error_models.registry import FACTORS, of_scope
from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/error_models/multipath.py",
    "emulator/error_models/shadowing.py",
    "emulator/error_models/phase_windup.py",
    "emulator/error_models/data_collection.py",
    what="Error models in a run",
    by="every factor, switched on by itself, shows on the bus; signals and latch by kinematics",
    status="modelled",
)

EPOCHS = 3
STATION = {"vehicle": "iss-asn-m.toml", "structure": "iss"}
JAMMER = {"direction_body": [0.0, 0.0, -1.0], "received_dbw": -100.0, "bandwidth_mhz": 20.0}


@dataclass(frozen=True)
class Case:
    """The smallest circumstances in which a factor shows.

    parameters  of the factor, where its defaults do nothing in so short a run
    craft       tables of the craft, where an ordinary one has nothing for the factor to act on
    """

    parameters: dict[str, Any] = field(default_factory=dict)
    craft: dict[str, Any] = field(default_factory=dict)


CASES = {  # others show as they are
    "cycle_slips": Case({"per_hour": 3600}),
    "loss_of_lock": Case({"stress_deg": 45.0}),
    "receive_pattern": Case({"pattern": "isotropic"}),
    "jamming": Case({"body": [JAMMER]}),
    "shadowing": Case({}, STATION),
    "multipath": Case({}, STATION),
}


def blocks(case, **on):
    """Frames of a few epochs with these factors on, all others off."""
    of_sky, of_craft = ({name: on.get(name, False) for name in of_scope(scope)} for scope in ("sky", "craft"))
    craft = emulated.craft(receivers=emulated.QUICK, factors=of_craft) | case.craft
    given = scenario.parse(emulated.document(craft, sky={"factors": of_sky}), "test")
    antennas = vehicle.load(vehicle.find(craft["vehicle"].removesuffix(".toml")))
    return emulated.run(assemble.build_world(given, [antennas], 7), EPOCHS)[1]


def content(block, kind):
    """What the frames of a kind say, each with its identifier."""
    rows = emulated.CODEC.kind_of[block.can_id] == emulated.CODEC.kinds[kind].number
    return np.column_stack((block.can_id[rows], block.data[rows]))


@pytest.mark.parametrize("name", FACTORS)
def test_a_factor_that_is_on_shows_on_the_bus(name):
    case = CASES.get(name, Case())
    without, with_it = blocks(case), blocks(case, **{name: case.parameters})
    pairs = zip(without, with_it, strict=True)
    assert not all(np.array_equal(*(content(block, FACTORS[name].shows) for block in pair)) for pair in pairs)


@pytest.mark.parametrize("craft", [{}, STATION], ids=["soyuz", "station"])
def test_without_a_factor_nothing_changes(craft):
    """The same again is the same: what shows above is the factor's."""
    once, again = (blocks(Case(craft=craft)) for _ in range(2))
    assert all(len(a) and np.array_equal(a.data, b.data) for a, b in zip(once, again, strict=True))


def test_every_case_is_of_a_factor():
    assert CASES.keys() <= FACTORS.keys()


def test_a_model_that_is_not_of_its_stage_is_refused(monkeypatch):
    stepped = Row("stepped", Factor, Stage.FRAMES, "made up", lambda params, context: Fixed(PathTerm()))
    monkeypatch.setitem(FACTORS, "stepped", stepped)
    with pytest.raises(ModelError, match=r"'stepped' \(stage FRAMES, sky\): Fixed has no `step`"):
        models_of({"stepped": Factor()}, None, "sky")
