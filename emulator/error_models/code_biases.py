"""Delays of code that stay: satellites' between their codes, receivers' between frequencies and as a whole.

Drawn once for a run. Carrier phases have none: theirs are swallowed by ambiguities.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.contract.messages import MAX_RECEIVERS
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models.params_receiver import InterchannelBias
from gnss_hil.emulator.error_models.params_sky import CodeBias
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import SKY_KEY, Stream

Array = NDArray[np.float64]

FREQUENCIES = np.arange(-7, 14)
"""GLONASS frequency numbers. GLONASS ICD 5.1 (2008), 3.3.1.1, table 3.1."""

_OTHER_CODE = signals.first_column(lambda signal: bool(signal.clock_code), False)
"""(8,) by system: whether clocks belong to another code than the one that receivers track."""

_PER_RECEIVER = 24  # one delay, one slope, a number for each frequency, one spare


def satellite_code_m(parameters: CodeBias, seed: int, index: NDArray[np.int64]) -> Array:
    """What to add to C/A pseudoranges (n,) [m] of satellites index (n,): C1 - P1, zero where
    broadcast clocks belong to the very code that is tracked."""
    raw = Stream(seed, SKY_KEY, "code_bias").words(0, satellites.SATELLITES)[index]
    p1_c1_ns = parameters.sigma_ns * keyed_draws.normal(raw)
    for name, given_ns in parameters.p1_c1_ns.items():
        p1_c1_ns[index == satellites.parse(name)] = given_ns
    biased = _OTHER_CODE[satellites.system_of(index)]
    return np.where(biased, -1e-9 * LIGHT_MPS * p1_c1_ns, 0.0)


def receiver_code_m(
    parameters: InterchannelBias, seed: int, craft_key: int, receivers: int
) -> tuple[Array, Array]:
    """What to add to pseudoranges [m]: (m,) all of a receiver's, and (m, 21) those of GLONASS by frequency
    number, FREQUENCIES."""
    raw = Stream(seed, craft_key, "interchannel_bias").words(0, MAX_RECEIVERS * _PER_RECEIVER)
    standard = keyed_draws.normal(raw).reshape(MAX_RECEIVERS, _PER_RECEIVER)[:receivers]
    slope = parameters.slope_m_per_channel * standard[:, 1:2]
    return parameters.hardware_m * standard[:, 0], slope * FREQUENCIES + parameters.scatter_m * standard[
        :, 2 : 2 + len(FREQUENCIES)
    ]
