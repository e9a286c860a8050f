"""Satellites' delays of the C/A code against the P code that their broadcast clocks belong to.

Drawn once for a run. Carrier phases have none: theirs are swallowed by ambiguities.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models.base import Context, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import SKY_KEY, Stream
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry


class CodeBias(Factor):
    """Satellites' delays of the C/A code against the P code that their broadcast clocks belong to.

    sigma_ns    1 sigma over satellites, GPS: that of the values for 28 satellites, December 1999 to
                March 2000, in IGS's cc2noncc (J. Ray), 0.28 m
    p1_c1_ns    satellite name ("G05") -> P1 - C1 [ns] as monthly files have it, instead of a draw
    """

    sigma_ns: Annotated[float, Field(ge=0, le=1000)] = 0.94
    p1_c1_ns: dict[
        Annotated[str, Field(pattern=r"^G(0[1-9]|[1-5]\d|6[0-3])$")],
        Annotated[float, Field(ge=-1000, le=1000)],
    ] = Field(default_factory=dict)


_OTHER_CODE = signals.first_column(lambda signal: bool(signal.clock_code), False)
"""(8,) by system: whether clocks belong to another code than the one that receivers track."""


def satellite_code_m(parameters: CodeBias, seed: int, index: I64) -> F64:
    """What to add to C/A pseudoranges (n,) [m] of satellites index (n,): C1 - P1, zero where
    broadcast clocks belong to the very code that is tracked."""
    raw = Stream(seed, SKY_KEY, "code_bias").words(0, satellites.SATELLITES)[index]
    p1_c1_ns = parameters.sigma_ns * keyed_draws.normal(raw)
    for name, given_ns in parameters.p1_c1_ns.items():
        p1_c1_ns[index == satellites.parse(name)] = given_ns
    biased = _OTHER_CODE[satellites.system_of(index)]
    return np.where(biased, -1e-9 * LIGHT_MPS * p1_c1_ns, 0.0)


@dataclass(frozen=True, slots=True)
class Model(PathModel):
    """code_m  (n,) to be added to pseudoranges [m]."""

    code_m: F64

    def block(self, at: ChannelGeometry) -> PathTerm:
        return PathTerm(range_m=self.code_m[at.row])


def build(params: CodeBias, context: Context) -> Model:
    return Model(satellite_code_m(params, context.seed, context.satellites))


ROW = Row(
    "code_bias",
    CodeBias,
    Stage.PATH,
    "differences of P1 and C1 in IGS's cc2noncc (J. Ray)",
    build,
    "sky",
)
