"""Clocks of signals beside each system's first: what satellites' messages say of the delays between them.

Broadcast clocks of GPS belong to the pair of P codes on L1 and L2; on a carrier they are later by T_GD
(f1 / f)^2. What codes differ from P codes beside it (ISC of CNAV) is in no message on the bus: receivers here
have the legacy message alone, and the rest is an error, `gnss_hil.emulator.error_models.code_bias`. Clocks of
GLONASS belong to L1; L2 is sent Delta tau_n later.
Sources: IS-GPS-200, 20.3.3.3.3.2; GLONASS ICD 5.1 (2008), 4.4
"""

from __future__ import annotations

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.signals import Signal, of_system
from gnss_hil.dbc.common.systems import SYSTEMS


def _share(signal: Signal) -> float:
    """1 - (f1 / f)^2 of a signal whose delay is a multiple of the group delay inside its system's clock."""
    first = of_system(SYSTEMS[signal.system])[0]
    if signal.group_delay == "delta_tau" or not first.group_delay:
        return 0.0
    return 1 - (first.carrier_hz / signal.carrier_hz) ** 2


_SHARE: F64 = signals.column(_share, 0.0)
_LATER: F64 = signals.column(lambda signal: float(signal.group_delay == "delta_tau"), 0.0)


def beyond_first_m(signal: I64, group_delay_m: F64, band_delay_m: F64) -> F64:
    """What to add to clocks (p,) [m], to be added to pseudoranges, of the systems' first signals for those of
    signals (p,), by their values on the bus.

    group_delay_m, band_delay_m   (p,) as broadcast, see `gnss_hil.emulator.constellation.base.Broadcast`
    """
    return _SHARE[signal] * group_delay_m - _LATER[signal] * band_delay_m
