"""A new kind of receivers takes a class and a row: the step, the plan and the bus know no kind by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from gnss_hil.emulator.assemble import world as assembled
from gnss_hil.emulator.assemble.emulated import build_emulated
from gnss_hil.emulator.assemble.world import ReceiverKind
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config import plan
from tests.support import emulated

QUIET_NODES = 0x700
"""Identifiers of heartbeats begin here."""


@dataclass(frozen=True)
class Switched:
    """Receivers that are switched off in every second epoch: nothing but heartbeats."""

    inside: Any
    obeys: bool = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inside, name)

    def step(self, unit, received, epoch):
        unit, block, truth = self.inside.step(unit, received, epoch)
        return unit, block[block.can_id >= QUIET_NODES] if epoch % 2 else block, truth


@pytest.fixture
def switched(monkeypatch):
    def build(shared, craft, vehicle):
        return Switched(build_emulated(shared, craft, vehicle))

    row = ReceiverKind("switched", lambda craft: craft.name == "soyuz", build)
    monkeypatch.setattr(assembled, "RECEIVER_KINDS", [row, *assembled.RECEIVER_KINDS])


def test_its_craft_is_stepped_as_any(switched):
    _, blocks, _ = emulated.run(emulated.world(emulated.craft(receivers=emulated.QUICK)), 4)
    heartbeats = [len(emulated.decode(block, "HEARTBEAT")["receiver"]) for block in blocks]
    assert len(set(heartbeats)) == 1 and heartbeats[0] > 0
    assert len(blocks[1]) == len(blocks[3]) == heartbeats[0] < len(blocks[0])


def test_a_policy_that_commands_it_in_vain_is_refused(switched):
    with pytest.raises(Mistake, match="craft soyuz: policy 'patent' commands receivers; this one is played"):
        plan.make("soyuz")
