"""Parameters of what the craft's own structure does to signals: shadows and reflections.

The formulas stand in `emulator.signal.structure.shadowing`, `.reflections` and `.multipath`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.emulator.error_models.params import Factor


class Shadowing(Factor):
    """Boxes and panels of the craft's structure hide satellites."""


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
