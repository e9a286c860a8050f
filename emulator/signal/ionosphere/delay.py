"""What electrons do to a signal: code late, carrier early, by the same length.

First order only. The second, 7527 c B cos / f^3 (IERS Conventions (2010), 9.4.1, typed from memory), is
below 2 cm on L1 for 100 TECU.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64

REFRACTION_M3PS2 = 40.308_193
"""e^2 / (8 pi^2 eps0 m_e), CODATA. IERS Conventions (2010), 9.4.1, writes 40.309; most others 40.3."""

ELECTRONS_PER_TECU = 1e16


def delay_m(tec_tecu: F64, carrier_hz: F64 | float) -> F64:
    """Delay of the code [m], advance of the carrier, by an electron content [TECU]."""
    return REFRACTION_M3PS2 * ELECTRONS_PER_TECU * tec_tecu / np.square(carrier_hz)


def tecu_of_delay_m(delay: F64, carrier_hz: float) -> F64:
    """Electron content [TECU] that delays the code by so much [m]."""
    return delay * carrier_hz**2 / (REFRACTION_M3PS2 * ELECTRONS_PER_TECU)
