"""Jammers, on the Earth and fixed to the craft."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.vehicle import Direction, Strict, unit_vector
from gnss_hil.emulator.error_models.base import Context, Fixed, LinkTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal import jamming
from gnss_hil.emulator.signal.jamming import Jammers

Seconds = Annotated[float, Field(ge=0, le=1e9)]
Level = Annotated[float, Field(ge=-300, le=100)]


class _Spectrum(Strict):
    """How a jammer's power is spread.

    kind   "noise": flat over bandwidth_mhz; "tone": a line; "matched": as the signals themselves
    centre_mhz      middle of the spectrum
    bandwidth_mhz   of noise
    on_s, off_s     after the run's first epoch: from when on, and until before when; always without them
    """

    kind: Literal["noise", "tone", "matched"] = "noise"
    centre_mhz: Annotated[float, Field(ge=1, le=100_000)] = 1575.42
    bandwidth_mhz: Annotated[float, Field(ge=1e-6, le=10_000)] = 2.046
    on_s: Seconds = 0.0
    off_s: Seconds | None = None

    @model_validator(mode="after")
    def _is_on_first(self):
        if self.off_s is not None and self.off_s <= self.on_s:
            raise ValueError(f"off_s {self.off_s:g} is not behind on_s {self.on_s:g}")
        return self


class EarthJammer(_Spectrum):
    """A jammer at a place on the Earth or above it, right-handed, equal in all directions.

    latitude_deg, longitude_deg   geodetic, WGS-84
    height_m   above the ellipsoid
    eirp_dbw   equivalent isotropically radiated power
    """

    latitude_deg: Annotated[float, Field(ge=-90, le=90)]
    longitude_deg: Annotated[float, Field(ge=-180, le=360)]
    height_m: Annotated[float, Field(ge=-500, le=50_000_000)] = 0.0
    eirp_dbw: Level


class BodyJammer(_Spectrum):
    """A jammer that keeps its direction in body axes.

    direction_body   towards it, of any length
    received_dbw     power that an isotropic antenna would receive
    """

    direction_body: Direction
    received_dbw: Level

    @model_validator(mode="after")
    def _is_a_direction(self):
        unit_vector("direction_body", self.direction_body)
        return self


class Jamming(Factor):
    """Jammers, one at least."""

    earth: tuple[EarthJammer, ...] = ()
    body: tuple[BodyJammer, ...] = ()

    @model_validator(mode="after")
    def _has_some(self):
        if self.enabled and not (self.earth or self.body):
            raise ValueError("no jammer: name one in earth or in body")
        return self


def jammers_of(params: Jamming, start_ns: int = 0) -> Jammers:
    """Jammers of a run that begins at start_ns as arrays, those on the Earth first."""
    places = [
        jamming.place_ecef_m(np.radians(one.latitude_deg), np.radians(one.longitude_deg), one.height_m)
        for one in params.earth
    ]
    every = (*params.earth, *params.body)
    return Jammers(
        np.array(places).reshape(-1, 3),
        np.array([one.eirp_dbw for one in params.earth], float),
        np.array([unit_vector("direction_body", one.direction_body) for one in params.body], float).reshape(
            -1, 3
        ),
        np.array([one.received_dbw for one in params.body], float),
        tuple(one.kind for one in every),
        np.array([one.centre_mhz * 1e6 for one in every], float),
        np.array([one.bandwidth_mhz * 1e6 for one in every], float),
        np.array([_on_ns(one, start_ns) for one in every], np.int64).reshape(-1, 2),
    )


def _on_ns(one: _Spectrum, start_ns: int) -> tuple[int, int]:
    """GPS time [ns] from which a jammer is on, and until before which."""
    until = np.iinfo(np.int64).max if one.off_s is None else start_ns + round(one.off_s * NS_PER_S)
    return start_ns + round(one.on_s * NS_PER_S), until


def build(params: Jamming, context: Context) -> Fixed[LinkTerm]:
    return Fixed(LinkTerm(jammers=jammers_of(params, context.start_ns)))


ROW = Row(
    "jamming",
    Jamming,
    Stage.LINK,
    "Betz, ION NTM 2000; Kaplan & Hegarty, 3rd ed., 9.2",
    build,
    ready=False,
    shows="RATE",
)
