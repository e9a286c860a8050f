"""Options of the measurements: how far they are trusted, and which signals make a range."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict


class MeasurementOptions(Strict):
    ura_scale: Annotated[
        float,
        Field(ge=0, le=10, description="how much of what satellites' orbits and clocks err by counts"),
    ] = 1.0
    range_sigma_m: Annotated[
        float,
        Field(
            ge=0,
            le=1000,
            description="1 sigma of every pseudorange, whatever the models say; 0: as they say",
        ),
    ] = 0.0
    ionosphere: Annotated[
        Literal["auto", "usual", "off"],
        Field(
            description="ranges of one signal are corrected: where receivers report an ionosphere, "
            "always, by a usual one where they report none, or never"
        ),
    ] = "auto"
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
