"""Faults inside the emulator, which frames do not show: its error models act, in a window of time.

`gnss_hil.emulator.assemble` hands them to the model; here is what a file says of them, and that they act.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gnss_hil.dbc.common.vehicle import Direction as Vector
from gnss_hil.dbc.common.vehicle import unit_vector
from gnss_hil.emulator.faults.base import Actions, Direction
from gnss_hil.emulator.faults.kinds.row import RUN, Bus, Idle, Row
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.emulator.faults.where import Where

Megahertz = Annotated[float, Field(ge=1e-6, le=100_000)]


class Jammer(Fault):
    """A jammer, on and off in time, that keeps its direction in body axes: a row of the scenario's factor
    `jamming`. It lowers C/N0 of every antenna that sees it; what receivers then lose, they lose.

    received_dbw     power that an isotropic antenna would receive
    direction_body   towards it, of any length; up in orbital attitude without it
    spectrum         "noise": flat over bandwidth_mhz; "tone": a line; "matched": as the signals themselves
    centre_mhz, bandwidth_mhz   of its spectrum
    """

    kind: Literal["jammer"]
    received_dbw: Annotated[float, Field(ge=-300, le=100)] = -115.0
    direction_body: Vector = (0.0, 0.0, -1.0)
    spectrum: Literal["noise", "tone", "matched"] = "noise"
    centre_mhz: Megahertz = 1575.42
    bandwidth_mhz: Megahertz = 2.046

    @model_validator(mode="after")
    def _is_a_window(self):
        unit_vector("direction_body", self.direction_body)
        if not self.on.everything:
            raise ValueError("on: a jammer has no place on the bus; direction_body says where it is")
        at = self.at
        if at.after is not None or at.every is not None or at.count is not None or at.probability < 1:
            raise ValueError("at: a jammer takes a window alone, @30..90")
        return self


def _acts(p: Jammer, bus: Bus, where: Where) -> Actions:
    return {Direction.FLIGHT: Idle()}


ROWS = (
    Row("jammer", Jammer, "a jammer, on and off in time", _acts, "jammer -115 @30..90", first="received_dbw",
        links=(RUN,), why="it needs the emulator's link budget", frames=False),
)  # fmt: skip
