"""Jammers, on the Earth and fixed to the craft."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.error_models.base import Context, ErrorModel, LinkTerm, Row, Stage
from gnss_hil.emulator.error_models.params_link import Jamming
from gnss_hil.emulator.signal import equipment


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    term: LinkTerm

    def link(self) -> LinkTerm:
        return self.term


def build(params: Jamming, context: Context) -> ErrorModel:
    return Model(LinkTerm(jammers=equipment.jammers_of(params)))


ROW = Row(
    "jamming",
    Jamming,
    Stage.LINK,
    "Betz, ION NTM 2000; Kaplan & Hegarty, 3rd ed., 9.2",
    build,
    ready=False,
    shows="RATE",
)
