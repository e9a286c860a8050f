"""Satellites' delays of civil codes against the P codes that their broadcast clocks belong to.

Drawn once for a run. Carrier phases have none: theirs are swallowed by ambiguities. The messages of L2C and
L5 (CNAV) have corrections (ISC), which receivers here do not know: what is drawn is all that codes differ by
beside multiples of T_GD.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models.base import Context, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import SKY_KEY, Stream
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry


class CodeBias(Factor):
    """Satellites' delays of civil codes against the P codes that their broadcast clocks belong to.

    sigma_ns    1 sigma over satellites, GPS, of C/A: that of the values for 28 satellites, December 1999 to
                March 2000, in IGS's cc2noncc (J. Ray), 0.28 m
    l2c_sigma_ns, l5_sigma_ns   the same of L2C against P on L2, and of L5 against the multiple of T_GD
                (modelled: as of C/A; receivers that read CNAV's ISC have a tenth of it)
    p1_c1_ns    satellite name ("G05") -> P1 - C1 [ns] as monthly files have it, instead of a draw
    """

    sigma_ns: Annotated[float, Field(ge=0, le=1000)] = 0.94
    l2c_sigma_ns: Annotated[float, Field(ge=0, le=1000)] = 0.94
    l5_sigma_ns: Annotated[float, Field(ge=0, le=1000)] = 0.94
    p1_c1_ns: dict[
        Annotated[str, Field(pattern=r"^G(0[1-9]|[1-5]\d|6[0-3])$")],
        Annotated[float, Field(ge=-1000, le=1000)],
    ] = Field(default_factory=dict)


_SIGMA = {"L1CA": "sigma_ns", "L2C": "l2c_sigma_ns", "L5": "l5_sigma_ns"}
"""Signals whose codes are not those that clocks belong to (`clock_code` of the contract's table), and the
parameter that has their sigma."""


def signal_code_m(parameters: CodeBias, seed: int, index: I64) -> F64:
    """What to add to pseudoranges (16, n) [m] of signals, by their values on the bus, of satellites index
    (n,); zero where broadcast clocks belong to the very code that is tracked."""
    out = np.zeros((signals.COUNT, len(index)))
    for name, sigma in _SIGMA.items():
        signal = SIGNALS[name]
        number = int(signals.beyond_first()[signal.value])
        raw = Stream(seed, SKY_KEY, "code_bias").words(number, satellites.SATELLITES)[index]
        early_ns = getattr(parameters, sigma) * keyed_draws.normal(raw)
        if name == "L1CA":
            for satellite, given_ns in parameters.p1_c1_ns.items():
                early_ns[index == satellites.parse(satellite)] = given_ns
        biased = SYSTEMS[signal.system].value == satellites.system_of(index)
        out[signal.value] = np.where(biased, -1e-9 * LIGHT_MPS * early_ns, 0.0)
    return out


@dataclass(frozen=True, slots=True)
class Model(PathModel):
    """code_m  (16, n) to be added to pseudoranges [m], by signal and row of the sky."""

    code_m: F64

    def block(self, at: ChannelGeometry) -> PathTerm:
        return PathTerm(range_m=self.code_m[at.signal, at.row])


def build(params: CodeBias, context: Context) -> Model:
    return Model(signal_code_m(params, context.seed, context.satellites))


ROW = Row(
    "code_bias",
    CodeBias,
    Stage.PATH,
    "differences of P1 and C1 in IGS's cc2noncc (J. Ray)",
    build,
    "sky",
)
