"""Which kind of receivers a craft gets: a file of observations is played, all others are emulated."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.frames import EMPTY
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.receivers.emulated.receiver import EmulatedCraft
from gnss_hil.emulator.receivers.recorded.receiver import RecordedCraft
from gnss_hil.emulator.step import emulate_step
from tests.support import emulated
from tests.support.rinex_observations import KNOWN_3

pytestmark = pytest.mark.verifies(
    "emulator/assemble/world.py",
    what="The kind of a craft's receivers",
    by="a craft with a file of observations beside one without, in both orders: what each puts on its bus",
    status="modelled",
)

KINDS = {"played": RecordedCraft, "flown": EmulatedCraft}


@pytest.mark.parametrize("names", [("played", "flown"), ("flown", "played")])
def test_a_file_is_played_and_all_else_emulated(names, tmp_path):
    file = tmp_path / "day.12o"
    file.write_text(KNOWN_3)
    tables = {
        "played": {"name": "played", "vehicle": "observed.toml", "observations": {"file": str(file)}},
        "flown": emulated.craft("flown", receivers=emulated.QUICK, factors=emulated.QUIET),
    }
    vehicles = {"played": vehicle.load(vehicle.find("observed")), "flown": emulated.VEHICLE}
    given = scenario.parse(emulated.document(*(tables[name] for name in names)), "test")
    world = assemble.build_world(given, [vehicles[name] for name in names], 7)
    assert {craft.name: (type(craft), craft.obeys) for craft in world.craft} == {
        name: (kind, kind is EmulatedCraft) for name, kind in KINDS.items()
    }
    # One channel has the file's one satellite of GPS; the emulated ones have all they can hold.
    _, sent, _ = emulate_step(world, assemble.initial_state(world), dict.fromkeys(names, EMPTY), 0)
    assert set(emulated.tracked(sent["played"], 1).values()) == {"G07"}
    assert len(emulated.tracked(sent["flown"], 1)) > 3
