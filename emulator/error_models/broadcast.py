"""Errors of what satellites report: what the rows for orbits and clocks have in common.

Their parameters are of each system, `gps_upload_s`, `glonass_upload_s`; a sky with a system that has none is
refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from gnss_hil.dbc.common import systems
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.error_models.base import (
    BlockModel,
    Context,
    ReportInput,
    ReportTerm,
    Row,
    Stage,
    require_systems,
)
from gnss_hil.emulator.error_models.params import Factor

Sigma = Annotated[float, Field(ge=0, le=1000)]
Period = Annotated[float, Field(ge=60, le=14 * 86400, multiple_of=60)]

Errors = Callable[[Any, int, I64, ReportInput], ReportTerm]
"""Parameters, seed, satellites (n,), where they are -> what they report too much."""


def by_system(parameters: Factor, key: str) -> dict[int, Any]:
    """The parameter `SYSTEM_key` of each system that has it, by the system's value."""
    named = {row.value: f"{row.name}_{key}" for row in systems.tracked()}
    return {value: getattr(parameters, name) for value, name in named.items() if hasattr(parameters, name)}


@dataclass(frozen=True, slots=True)
class Model:
    """Satellites' errors, the same for all craft."""

    errors: Errors
    params: Factor
    seed: int
    satellites: I64

    def block(self, at: ReportInput) -> ReportTerm:
        return self.errors(self.params, self.seed, self.satellites, at)


def row(
    name: str, params: type[Factor], errors: Errors, source: str, shows: str
) -> Row[BlockModel[ReportInput, ReportTerm]]:
    """The row of an error of what satellites report, one for all craft."""

    def build(params: Factor, context: Context) -> Model:
        require_systems(context, by_system(params, "upload_s"), "errors")
        return Model(errors, params, context.seed, context.satellites)

    return Row(name, params, Stage.BROADCAST, source, build, "sky", acts_on="report", shows=shows)
