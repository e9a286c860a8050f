"""Options of the measurements: how far they are trusted, and which signals make a range."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.flightsw.measurement.noise import Noise


class MeasurementOptions(Strict):
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
        Field(description="ranges made of two signals of a satellite, without ionosphere"),
    ] = False
    ionosphere_walk_mps_rts: Annotated[
        float,
        Field(
            ge=0,
            le=10,
            description="how the rates of the ionosphere's delays walk (0.01: a low orbit); 0: not followed",
        ),
    ] = 0.0
    without_pairs: Annotated[
        Literal["one-signal", "no-fix"],
        Field(
            description="what is done where such ranges make no fix: one signal of each satellite, or none"
        ),
    ] = "one-signal"

    @property
    def noise(self) -> Noise:
        return Noise(self.code_floor_m, self.code_noise_m, self.rate_floor_mps, self.rate_noise_mps)
