"""What the emulator steps: a craft and its receivers, of whatever kind.

A kind is a class that has these members, and a row in `gnss_hil.emulator.assemble.world.RECEIVER_KINDS` that
builds it from a scenario; the step, the loop and the tools know no kind by name.
"""

from __future__ import annotations

from typing import Any, Protocol

from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch


class Unit(Protocol):
    """A craft between epochs, what all kinds have in common: (verdicts,) command frames refused so far, by
    `gnss_hil.dbc.contract.screening.Verdict`."""

    @property
    def refused(self) -> I64: ...


class Craft(Protocol):
    """What does not change of a craft in a run."""

    @property
    def name(self) -> str: ...
    @property
    def vehicle(self) -> Vehicle: ...
    @property
    def codec(self) -> Codec: ...
    @property
    def obeys(self) -> bool:
        """Whether its receivers do what they are commanded."""
        ...

    def fresh(self) -> Any:
        """The unit before the first epoch."""

    def prepare(self, unit: Any, epoch: int) -> None:
        """Work for an epoch that can be done before its frames are in: `step` is quicker then, not other."""
        ...

    def step(self, unit: Any, received: FrameBatch, epoch: int) -> tuple[Any, FrameBatch, NDArray]:
        """One epoch: the unit after it, its frames, and truth, a row of `gnss_hil.emulator.truth.TRUTH` but
        for the craft's number. A pure function of its arguments."""
        ...
