"""Electrons around the Earth: code late, carrier and its rate early. Range rates are the carrier's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models.base import Context, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.files import ionex, ionosphere_header
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.geometry import spin
from gnss_hil.emulator.signal.ionosphere import field
from gnss_hil.emulator.signal.ionosphere.delay import delay_m
from gnss_hil.emulator.signal.ionosphere.klobuchar import Coefficients, as_broadcast
from gnss_hil.emulator.signal.ionosphere.map_files import joined
from gnss_hil.emulator.signal.ionosphere.presets import PRESETS
from gnss_hil.emulator.signal.ionosphere.profile import Profile
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_and_rate

Alpha = Annotated[float, Field(ge=-1e-5, le=1e-5)]
Beta = Annotated[float, Field(ge=-1e7, le=1e7)]
"""A message's eight bits carry at most 7.6e-6 and 8.4e6 (IS-GPS-200, table 20-X)."""
Share = Annotated[float, Field(ge=0, lt=1)]


class Ionosphere(Factor):
    """Electrons around the Earth, one sky for all craft.

    model         where the vertical content comes from: the coefficients GPS broadcasts, or measured maps
    activity      of the Sun: coefficients and profile wherever nothing else is given
    alpha, beta   coefficients of one's own, as broadcast [s, semicircles]
    files         "ionex": maps that together cover the run; "klobuchar": one navigation file whose header
                  has the coefficients
    the others    heights and scales of the profile, in place of the preset's
    """

    model: Literal["klobuchar", "ionex"] = "klobuchar"
    activity: Literal["low", "high"] = "low"
    alpha: tuple[Alpha, Alpha, Alpha, Alpha] | None = None
    beta: tuple[Beta, Beta, Beta, Beta] | None = None
    files: tuple[str, ...] = ()
    peak_height_km: Annotated[float, Field(ge=150, le=600)] | None = None
    bottomside_scale_km: Annotated[float, Field(ge=10, le=150)] | None = None
    topside_scale_km: Annotated[float, Field(ge=20, le=300)] | None = None
    plasmasphere_scale_km: Annotated[float, Field(ge=500, le=20_000)] | None = None
    plasmasphere_share: Share | None = None

    @model_validator(mode="after")
    def _sources(self):
        if (self.alpha is None) != (self.beta is None):
            raise ValueError("alpha and beta belong together")
        if self.model == "ionex" and (not self.files or self.alpha):
            raise ValueError("model 'ionex' takes its content from files alone: name one or more")
        if self.model == "klobuchar" and len(self.files) > (0 if self.alpha else 1):
            raise ValueError("model 'klobuchar' takes alpha and beta, or one navigation file")
        return self


_PROFILE = {
    "peak_height_km": ("peak_m", 1e3),
    "bottomside_scale_km": ("bottomside_m", 1e3),
    "topside_scale_km": ("topside_m", 1e3),
    "plasmasphere_scale_km": ("plasmasphere_m", 1e3),
    "plasmasphere_share": ("plasmasphere_share", 1.0),
}


def profile_of(params: Ionosphere) -> Profile:
    """The preset's profile, with what the scenario states in its place."""
    given = ((scale, unit, getattr(params, name)) for name, (scale, unit) in _PROFILE.items())
    return replace(
        PRESETS[params.activity].profile,
        **{scale: unit * value for scale, unit, value in given if value is not None},
    )


def build_field(params: Ionosphere, files: Sequence[Path], span_ns: tuple[int, int]) -> field.Field:
    """The field of a run.

    files    the parameters', as paths that can be opened
    span_ns  first and last GPS time of the run [ns]; maps have to cover it
    Raises FileError with one line.
    """
    profile = profile_of(params)
    if params.model == "ionex":
        return field.of_maps(
            joined([ionex.read(path) for path in files], ", ".join(map(str, files)), span_ns), profile
        )
    return field.of_coefficients(_coefficients(params, files), profile)


def broadcast(params: Ionosphere, files: Sequence[Path]) -> Coefficients:
    """What satellites say of it, in steps and bounds of the message: of measured maps what they said on a day
    of such activity."""
    stated = _coefficients(params, [] if params.model == "ionex" else files)
    return as_broadcast(stated)


def _coefficients(params: Ionosphere, files: Sequence[Path]) -> Coefficients:
    if params.alpha is not None and params.beta is not None:
        return Coefficients(params.alpha, params.beta)
    if files:
        header = ionosphere_header.read(files[0])
        return Coefficients(header.alpha, header.beta)
    return PRESETS[params.activity].coefficients


@dataclass(frozen=True, slots=True)
class Model(PathModel):
    electrons: field.Field

    def block(self, at: ChannelGeometry) -> PathTerm:
        epochs, place = at.epochs, (at.at, at.receiver)
        pos_m = epochs.antennas.pos_m[place]
        vel_mps = epochs.antennas.vel_mps[place] - spin(pos_m)
        sky, satellite = epochs.sky, (at.at, at.row)
        since_ns = epochs.t_ns[at.at] - epochs.t_ns[0]
        content, rate = slant_tec_and_rate(
            self.electrons, int(epochs.t_ns[0]), pos_m, vel_mps, sky.pos_ecef_m[satellite],
            sky.vel_ecef_mps[satellite], 1e-9 * since_ns,
        )  # fmt: skip
        carrier_hz = LIGHT_MPS / at.wave_m
        delay = delay_m(content, carrier_hz)
        return PathTerm(delay, -delay, -delay_m(rate, carrier_hz))


def build(params: Ionosphere, context: Context) -> Model:
    return Model(build_field(params, [context.open_path(name) for name in params.files], context.span_ns))


ROW = Row(
    "ionosphere",
    Ionosphere,
    Stage.PATH,
    "IS-GPS-200, 20.3.3.5.2.5; IONEX 1.0; Chapman layers",
    build,
    "sky",
)
