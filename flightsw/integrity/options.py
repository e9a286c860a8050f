"""Options of integrity: what becomes of measurements that contradict each other."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.flightsw.integrity.exclusion import Rules


class IntegrityOptions(Strict):
    exclude_satellites: Annotated[
        int,
        Field(ge=0, le=16, description="so many satellites that contradict the others are left out at most"),
    ] = 3
    exclude_receivers: Annotated[
        int,
        Field(ge=0, le=7, description="so many receivers that contradict the others are left out at most"),
    ] = 1
    inconsistent: Annotated[
        Literal["refuse", "fix"],
        Field(description="ranges that contradict each other are refused, or make a fix of larger sigma"),
    ] = "refuse"

    @property
    def rules(self) -> Rules:
        return Rules(self.exclude_satellites, self.exclude_receivers, self.inconsistent == "refuse")
