"""Options that every policy has."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dbc.vehicle import Strict


class Options(Strict):
    ray_height_km: Annotated[float, Field(ge=0, le=2000, description="lowest ray above the ellipsoid")] = 50.0
    ura_scale: Annotated[
        float,
        Field(ge=0, le=10, description="how much of the broadcast range accuracy counts in the weights"),
    ] = 1.0
    attitude_hold_epochs: Annotated[
        int, Field(ge=0, le=600, description="how long the last attitude is turned on by its rates")
    ] = 0
    resend_epochs: Annotated[
        int, Field(ge=1, le=60, description="a command unanswered for so long is repeated")
    ] = 2
    backoff_epochs: Annotated[
        int, Field(ge=1, le=3600, description="a satellite a receiver refused is left alone for so long")
    ] = 30
    autonomy_after_epochs: Annotated[
        int,
        Field(ge=1, le=86400, description="without a fix for so long, receivers search by themselves again"),
    ] = 120
