"""Options that every policy has."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.flightsw.receivers.options import ChannelOptions


class Options(ChannelOptions):
    ray_height_km: Annotated[float, Field(ge=0, le=2000, description="lowest ray above the ellipsoid")] = 50.0
    ura_scale: Annotated[
        float,
        Field(ge=0, le=10, description="how much of the broadcast range accuracy counts in the weights"),
    ] = 1.0
    code_noise_m: Annotated[
        float, Field(ge=0, le=100, description="1 sigma of a GPS L1 C/A pseudorange at 45 dBHz")
    ] = 0.50
    code_floor_m: Annotated[float, Field(ge=0.001, le=100, description="what no C/N0 takes away of it")] = (
        0.10
    )
    rate_noise_mps: Annotated[float, Field(ge=0, le=10, description="1 sigma of a range rate at 45 dBHz")] = (
        0.05
    )
    rate_floor_mps: Annotated[float, Field(ge=0.0001, le=10, description="what no C/N0 takes away of it")] = (
        0.005
    )
    ionosphere_free: Annotated[
        bool,
        Field(description="only ranges made of two signals of a satellite, without ionosphere"),
    ] = False
    exclude_satellites: Annotated[
        int,
        Field(ge=0, le=16, description="so many satellites that contradict the others are left out at most"),
    ] = 1
    inconsistent: Annotated[
        Literal["refuse", "fix"],
        Field(description="ranges that contradict each other are refused, or make a fix of larger sigma"),
    ] = "refuse"
    attitude_hold_epochs: Annotated[
        int, Field(ge=0, le=600, description="how long the last attitude is turned on by its rates")
    ] = 0
    autonomy_after_epochs: Annotated[
        int,
        Field(ge=1, le=86400, description="without a fix for so long, receivers search by themselves again"),
    ] = 120
