"""Noise and losses of the receivers."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.error_models.base import Context, ErrorModel, LinkTerm, Row, Stage
from gnss_hil.emulator.error_models.params_link import LinkBudget
from gnss_hil.emulator.signal import equipment


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    term: LinkTerm

    def link(self) -> LinkTerm:
        return self.term


def build(params: LinkBudget, context: Context) -> ErrorModel:
    noise_wphz, loss_db = equipment.front_end_of(params)
    return Model(LinkTerm(noise_wphz=noise_wphz, loss_db=loss_db))


ROW = Row(
    "link_budget",
    LinkBudget,
    Stage.LINK,
    "Friis, Proc. IRE 32 (1944) 419",
    build,
    shows="RATE",
)
