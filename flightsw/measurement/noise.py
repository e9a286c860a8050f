"""How far a measurement is trusted. Modelled, not taken from any receiver; the weights need ratios only.

Code and range rate errors are a floor plus thermal noise whose variance is inverse to C/N0 (Kaplan & Hegarty,
Understanding GPS/GNSS, 3rd ed., 8.9: the leading term of the delay and frequency lock loops' errors).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.dbc.common.systems import reference


@dataclass(frozen=True, slots=True)
class Noise:
    """1 sigma: floors, and thermal noise at 45 dBHz; the code's on GPS L1 C/A."""

    code_floor_m: float = 0.10
    code_m: float = 0.50
    rate_floor_mps: float = 0.005
    rate_mps: float = 0.05


# Nominal URA of index 0..15. Source: IS-GPS-200, 20.3.3.3.1.3: 2^(1 + N/2) up to 6 with 2.8, 5.7 and 11.3
# rounded as printed there, 2^(N - 2) above; 15 means that no prediction is given: not used for a fix.
URA_M = np.array([2, 2.8, 4, 5.7, 8, 11.3, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, np.inf])
NO_URA = 15

_MCHIPS = signals.first_column(lambda signal: signal.chip_hz / 1e6, np.nan)
_CHIP: F64 = np.nan_to_num(_MCHIPS[reference().value] / _MCHIPS, nan=1.0)
"""(8,) by system: length of a chip of its first signal, that of the reference system's being 1."""


def _thermal(cn0_dbhz: F64) -> F64:
    """(n,) noise to signal ratio relative to 45 dBHz."""
    return 10 ** (4.5 - 0.1 * cn0_dbhz)


def variances(cn0_dbhz: F64, sat: I64, noise: Noise = Noise()) -> tuple[F64, F64]:
    """(n,) of pseudoranges [m^2], whose noise is a share of the chip of the satellite's system, and of range
    rates [m^2/s^2]."""
    thermal = _thermal(cn0_dbhz)
    code = noise.code_floor_m**2 + (noise.code_m * _CHIP[sat // NUMBERS]) ** 2 * thermal
    return code, noise.rate_floor_mps**2 + noise.rate_mps**2 * thermal


def range_variance_m2(code_variance: F64, ura: F64, sat: I64, ura_scale: float = 1.0) -> F64:
    """(n,) variance of pseudoranges from that of their noise (n,) [m^2]; the URA counts `ura_scale` times.

    The satellite's own error (URA) is the same on every antenna that tracks it: averaging its k measurements
    does not average it out. Each gets k times the URA variance, which gives their mean the right variance.
    """
    copies = np.bincount(sat)[sat]
    return code_variance + copies * (ura_scale * URA_M[ura.astype(np.intp)]) ** 2
