"""Single reflections from the craft's structure through the correlators."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.emulator.error_models.base import CraftContext, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.multipath.reception import receive_channels


class Multipath(Factor):
    """Single reflections from the structure's faces through the correlators.

    discriminator             "power": |E|^2 - |L|^2, as `code_noise`; "coherent": dot product, coherent loop
    bandwidth_mhz             two-sided, of the front end; none: infinitely wide
    reflections               how many of each signal's strongest count
    least_amplitude           weaker ones do not, relative to the direct ray
    cross_polar_db            an antenna receives left-handed waves weaker by this than right-handed ones from
                              the same direction (10 dB: typical of a patch antenna, not published for ASN-M)
    nearest_m                 a face whose plane is closer to the antenna belongs to its receive pattern
    hold_reflections          whether a reflection may stay in lock while the direct ray is hidden
    """

    discriminator: Literal["coherent", "power"] = "power"
    bandwidth_mhz: Annotated[float, Field(ge=1, le=100)] | None = None
    reflections: Annotated[int, Field(ge=1, le=16)] = 4
    least_amplitude: Annotated[float, Field(ge=0, lt=1)] = 0.01
    cross_polar_db: Annotated[float, Field(ge=0, le=40)] = 10.0
    nearest_m: Annotated[float, Field(ge=0.01, le=10)] = 0.5
    hold_reflections: bool = True


@dataclass(frozen=True, slots=True)
class Model(PathModel):
    params: Multipath
    spacing_chips: float
    reaches: bool
    leads: bool = True

    def block(self, at: ChannelGeometry) -> PathTerm:
        found = receive_channels(self.params, self.spacing_chips, at)
        return PathTerm(found.range_m, found.phase_m, found.rate_mps, level_db=found.level_db)


def build(params: Multipath, context: CraftContext) -> Model:
    return Model(params, context.loops.correlator_spacing_chips, params.hold_reflections)


ROW = Row(
    "multipath",
    Multipath,
    Stage.PATH,
    "van Nee, IEEE Trans. AES 29 (1993) 1359; Kaplan & Hegarty, 3rd ed., 9.5",
    build,
    needs=frozenset({"structure"}),
)
