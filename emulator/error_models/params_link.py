"""Parameters of the link budget; formulas stand in `emulator.signal`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gnss_hil.dbc.common.vehicle import Strict, Vector
from gnss_hil.emulator.error_models.params import Factor

GpsBlock = Literal["gps-iia", "gps-iir", "gps-iir-improved", "gps-iif", "gps-iii"]
Block = GpsBlock | Literal["glonass-m"]
Level = Annotated[float, Field(ge=-300, le=100)]


class TransmitPattern(Factor):
    """Satellites' antennas and powers.

    level    "typical": as their makers and users published; "minimum": what the interface documents promise
    gps      block of all GPS satellites, or the one each number had on the day the run starts
    blocks   satellite name ("G05") -> block, where that is not what is wanted
    """

    level: Literal["typical", "minimum"] = "typical"
    gps: GpsBlock | Literal["by-date"] = "by-date"
    blocks: dict[Annotated[str, Field(pattern=r"^[GR]\d\d$")], Block] = Field(default_factory=dict)


class ReceivePattern(Factor):
    """The craft's antennas.

    pattern                    "law" (through gain_dbi and gain_at_90deg_dbi), a shipped name, or a file
    column                     gain column of a file that has several
    antennas                   antenna name -> pattern, where it differs
    floor_dbi                  gain at 180 deg of a table that ends before
    How weakly left-handed waves are received belongs to reflections: `Multipath.cross_polar_db`.
    """

    pattern: str = "law"
    column: str = ""
    gain_dbi: Annotated[float, Field(ge=-20, le=30)] = 4.0
    gain_at_90deg_dbi: Annotated[float, Field(ge=-60, le=30)] = -6.0
    antennas: dict[str, str] = Field(default_factory=dict)
    floor_dbi: Annotated[float, Field(ge=-120, le=30)] = -20.0


class LinkBudget(Factor):
    """Noise and losses.

    antenna_temperature_k    what the antenna sees of sky and Earth
    line_loss_db             between antenna and first amplifier, at line_temperature_k
    noise_figure_db          of the receiver
    implementation_loss_db   quantisation and the rest: one bit costs 1.96 dB, two bits 0.55 dB
    """

    antenna_temperature_k: Annotated[float, Field(ge=0, le=5000)] = 130.0
    line_loss_db: Annotated[float, Field(ge=0, le=20)] = 0.5
    line_temperature_k: Annotated[float, Field(ge=0, le=1000)] = 290.0
    noise_figure_db: Annotated[float, Field(ge=0, le=30)] = 2.0
    implementation_loss_db: Annotated[float, Field(ge=0, le=20)] = 1.0


class _Spectrum(Strict):
    """How a jammer's power is spread.

    kind   "noise": flat over bandwidth_mhz; "tone": a line; "matched": as the signals themselves
    """

    kind: Literal["noise", "tone", "matched"] = "noise"
    centre_mhz: Annotated[float, Field(gt=0, le=100_000)] = 1575.42
    bandwidth_mhz: Annotated[float, Field(gt=0, le=10_000)] = 2.046


class EarthJammer(_Spectrum):
    """A jammer at a place on the Earth or above it, right-handed, equal in all directions."""

    latitude_deg: Annotated[float, Field(ge=-90, le=90)]
    longitude_deg: Annotated[float, Field(ge=-180, le=360)]
    height_m: Annotated[float, Field(ge=-500, le=50_000_000)] = 0.0
    eirp_dbw: Level


class BodyJammer(_Spectrum):
    """A jammer that keeps its direction in body axes, by the power an isotropic antenna receives."""

    direction_body: Vector
    received_dbw: Level

    @model_validator(mode="after")
    def _is_a_direction(self):
        norm = sum(x * x for x in self.direction_body) ** 0.5
        if abs(norm - 1) > 1e-3:
            raise ValueError(f"direction_body has length {norm:.4g}; a direction has length 1")
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
