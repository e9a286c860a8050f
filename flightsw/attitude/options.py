"""Options of the attitude input."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict


class AttitudeOptions(Strict):
    attitude_hold_epochs: Annotated[
        int, Field(ge=0, le=600, description="how long the last attitude is turned on by its rates")
    ] = 120
