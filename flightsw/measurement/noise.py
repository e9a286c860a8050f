"""How far a measurement is trusted. Modelled, not taken from any receiver; the weights need ratios only.

Code and range rate errors are a floor plus thermal noise whose variance is inverse to C/N0 (Kaplan & Hegarty,
Understanding GPS/GNSS, 3rd ed., 8.9: the leading term of the delay and frequency lock loops' errors).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import GLONASS, NUMBERS


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


def _thermal(cn0_dbhz: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) noise to signal ratio relative to 45 dBHz."""
    return 10 ** (4.5 - 0.1 * cn0_dbhz)


def code_variance_m2(
    cn0_dbhz: NDArray[np.float64], sat: NDArray[np.int64], noise: Noise = Noise()
) -> NDArray[np.float64]:
    """(n,) of the code loop, whose noise is a share of the chip: 1.023 Mchip/s (IS-GPS-200 3.3.2.1), GLONASS
    0.511 Mchip/s (ICD L1, L2 5.1, 3.3.2)."""
    chip = np.where(sat >= GLONASS * NUMBERS, 1.023 / 0.511, 1.0)
    return noise.code_floor_m**2 + (noise.code_m * chip) ** 2 * _thermal(cn0_dbhz)


def rate_variance_m2ps2(cn0_dbhz: NDArray[np.float64], noise: Noise = Noise()) -> NDArray[np.float64]:
    return noise.rate_floor_mps**2 + noise.rate_mps**2 * _thermal(cn0_dbhz)


def range_variance_m2(
    code_variance: NDArray[np.float64], ura: NDArray, sat: NDArray[np.int64], ura_scale: float = 1.0
) -> NDArray[np.float64]:
    """(n,) variance of pseudoranges from that of their noise (n,) [m^2]; the URA counts `ura_scale` times.

    The satellite's own error (URA) is the same on every antenna that tracks it: averaging its k measurements
    does not average it out. Each gets k times the URA variance, which gives their mean the right variance.
    """
    copies = np.bincount(sat)[sat]
    return code_variance + copies * (ura_scale * URA_M[ura.astype(np.intp)]) ** 2
