"""Noise and losses of the receivers."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gnss_hil.emulator.error_models.base import Context, Fixed, LinkTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal import frontend


class LinkBudget(Factor):
    """Noise and losses.

    antenna_temperature_k    what the antenna sees of sky and Earth
    line_loss_db             between antenna and first amplifier, at line_temperature_k
    line_temperature_k       of the line itself
    noise_figure_db          of the receiver
    implementation_loss_db   quantisation and the rest: one bit costs 1.96 dB, two bits 0.55 dB
    """

    antenna_temperature_k: Annotated[float, Field(ge=0, le=5000)] = 130.0
    line_loss_db: Annotated[float, Field(ge=0, le=20)] = 0.5
    line_temperature_k: Annotated[float, Field(ge=0, le=1000)] = 290.0
    noise_figure_db: Annotated[float, Field(ge=0, le=30)] = 2.0
    implementation_loss_db: Annotated[float, Field(ge=0, le=20)] = 1.0


def front_end_of(params: LinkBudget) -> tuple[float, float]:
    """Noise density at the antennas' terminals [W/Hz], and loss of the digital part [dB]."""
    system_k = frontend.system_temperature_k(
        params.antenna_temperature_k, params.line_loss_db, params.line_temperature_k, params.noise_figure_db
    )
    return float(frontend.density_wphz(system_k)), params.implementation_loss_db


def build(params: LinkBudget, context: Context) -> Fixed[LinkTerm]:
    noise_wphz, loss_db = front_end_of(params)
    return Fixed(LinkTerm(noise_wphz=noise_wphz, loss_db=loss_db))


ROW = Row(
    "link_budget",
    LinkBudget,
    Stage.LINK,
    "Friis, Proc. IRE 32 (1944) 419",
    build,
    shows="RATE",
)
