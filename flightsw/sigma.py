"""How far a measurement is trusted. Modelled, not taken from any receiver; the weights need ratios only.

Code and range rate errors are a floor plus thermal noise whose variance is inverse to C/N0 (Kaplan & Hegarty,
Understanding GPS/GNSS, 3rd ed., 8.9: the leading term of the delay and frequency lock loops' errors).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dbc.satellites import GLONASS, NUMBERS

CODE_FLOOR_M, CODE_AT_45_M = 0.10, 0.50  # on GPS L1 C/A
RATE_FLOOR_MPS, RATE_AT_45_MPS = 0.005, 0.05

# Nominal URA of index 0..15. Source: IS-GPS-200, 20.3.3.3.1.3: 2^(1 + N/2) up to 6 with 2.8, 5.7 and 11.3
# rounded as printed there, 2^(N - 2) above; 15 means that no prediction is given: not used for a fix.
URA_M = np.array([2, 2.8, 4, 5.7, 8, 11.3, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, np.inf])
NO_URA = 15


def _thermal(cn0_dbhz: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) noise to signal ratio relative to 45 dBHz."""
    return 10 ** (4.5 - 0.1 * cn0_dbhz)


def code_variance_m2(cn0_dbhz: NDArray[np.float64], sat: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n,) of the code loop, whose noise is a share of the chip: 1.023 Mchip/s (IS-GPS-200 3.3.2.1), GLONASS
    0.511 Mchip/s (ICD L1, L2 5.1, 3.3.2)."""
    chip = np.where(sat >= GLONASS * NUMBERS, 1.023 / 0.511, 1.0)
    return CODE_FLOOR_M**2 + (CODE_AT_45_M * chip) ** 2 * _thermal(cn0_dbhz)


def rate_variance_m2ps2(cn0_dbhz: NDArray[np.float64]) -> NDArray[np.float64]:
    return RATE_FLOOR_MPS**2 + RATE_AT_45_MPS**2 * _thermal(cn0_dbhz)


def range_variance_m2(
    cn0_dbhz: NDArray[np.float64], ura: NDArray, sat: NDArray[np.int64], ura_scale: float = 1.0
) -> NDArray[np.float64]:
    """(n,) variance of pseudoranges; the URA counts `ura_scale` times.

    The satellite's own error (URA) is the same on every antenna that tracks it: averaging its k measurements
    does not average it out. Each gets k times the URA variance, which gives their mean the right variance.
    """
    copies = np.bincount(sat)[sat]
    return code_variance_m2(cn0_dbhz, sat) + copies * (ura_scale * URA_M[ura.astype(np.intp)]) ** 2
