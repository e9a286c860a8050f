"""Faults that need the emulator's inside: known by name, so that nobody looks for them in vain, and refused.

They are error models of the scenario (`[craft.factors]`): what they do to signals depends on geometry and on
what receivers do, which frames do not show.
"""

from __future__ import annotations

from typing import Literal

from gnss_hil.emulator.faults.base import Actions
from gnss_hil.emulator.faults.kinds.row import Bus, Row
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.emulator.faults.where import Where


class Jammer(Fault):
    """A jammer, on and off in time: not a fault of frames."""

    kind: Literal["jammer"]


def _refused(p: Jammer, bus: Bus, where: Where) -> Actions:
    raise ValueError("a jammer is not a fault of frames")


ROWS = (
    Row("jammer", Jammer, "a jammer, on and off in time: by the scenario's factor jamming alone", _refused,
        "jammer @30..90", links=(),
        why="it needs the emulator's link budget: [craft.factors.jamming] of the scenario"),
)  # fmt: skip
