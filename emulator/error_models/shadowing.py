"""Boxes and panels of the craft's structure hide satellites."""

from __future__ import annotations

from gnss_hil.emulator.error_models.base import Context, Row, Stage, VisibilityTerm
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry


class Shadowing(Factor):
    """Boxes and panels of the craft's structure hide satellites."""


class Model:
    def block(self, at: EpochGeometry) -> VisibilityTerm:
        assert at.structure is not None, "the row needs one"
        return VisibilityTerm(hides=at.structure.hidden)


def build(params: Shadowing, context: Context) -> Model:
    return Model()


ROW = Row(
    "shadowing",
    Shadowing,
    Stage.VISIBILITY,
    "Kay & Kajiya, Computer Graphics 20 (1986) 269",
    build,
    needs=frozenset({"structure"}),
    shows="STATUS",
)
