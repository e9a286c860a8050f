"""What satellites report of themselves, their orbits and clocks, and how far that is true.

A satellite's accuracy index is a bound: it promises that ranges are wrong by no more than 4.42 times the
accuracy but once in 1e5. What ranges err by as a rule is less, and known from years of comparison; by it
measurements are weighed. An index worse than a system's usual one makes it larger in proportion, one that
promises better than that is taken at its word.

Sources: IS-GPS-200, 20.3.3.3.1.3 and 30.3.3.1.1.4 (indices); SPS Performance Standard, 5th edition, 3.4
(4.42); Montenbruck, Steigenberger & Hauschild, Adv. Space Research 61 (2018) 3020 (0.6 m GPS, 2 m GLONASS)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import signals, systems
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.satellites import NUMBERS

BEST, WORST = -15, 14
"""Accuracy indices: a centimetre or better; 4.1 km. Those beyond, -16 and 15, are no prediction at all, "use
at own risk", and not for a fix."""

_NOMINAL = (2.0, 2.8, 4.0, 5.7, 8.0, 11.3, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0, 1024.0, 2048.0, 4096.0)
"""Accuracy of index 0 to 14 [m]: 2^(1 + N/2) up to 6 with 2.8, 5.7 and 11.3 rounded as printed in the source,
2^(N - 2) above; below 0 it is 2^(1 + N/2)."""

URA_M: F64 = np.array([*_NOMINAL, np.inf, np.inf, *(2 ** (1 + n / 2) for n in range(BEST, 0))])
"""(32,) by index, negative ones counted from the end."""


@dataclass(frozen=True, slots=True)
class Usual:
    """1 sigma of what a satellite's report makes ranges err by, at its usual accuracy index and better.

    range_m   orbit and clock;  rate_mps  of its clock within a second, white frequency noise
    """

    range_m: float
    rate_mps: float
    ura: int


USUAL = {
    "gps": Usual(0.6, 0.0015, 0),
    "glonass": Usual(2.0, 0.003, 4),
}
"""By system; others are taken for GPS."""

_RANGE_M: F64 = systems.column(lambda system: USUAL.get(system.name, USUAL["gps"]).range_m, np.nan)
_RATE_MPS: F64 = systems.column(lambda system: USUAL.get(system.name, USUAL["gps"]).rate_mps, np.nan)
_USUAL_URA_M: F64 = URA_M[systems.column(lambda system: USUAL.get(system.name, USUAL["gps"]).ura, 0)]


CODE_BIAS_M = 0.28
"""1 sigma of a satellite's delay of a code against the one that its clock belongs to: of P1 - C1 of 28
satellites in IGS's cc2noncc, December 1999 to March 2000."""

_OTHER_CODE: F64 = CODE_BIAS_M * signals.column(lambda signal: bool(signal.clock_code), False)


def predicted(ura: F64) -> Bool:
    """Whether indices (n,) promise anything."""
    return (ura >= BEST) & (ura <= WORST)


def space_sigma(ura: F64, sat: I64, signal: I64) -> tuple[F64, F64, F64]:
    """1 sigma (n,) of orbits and clocks in ranges [m], of codes against those that clocks belong to [m], and
    of clocks in range rates [m/s]; by accuracy index, satellite and signal (n,) each."""
    accuracy_m, system = URA_M[ura.astype(np.intp)], sat // NUMBERS
    worse = np.maximum(accuracy_m / _USUAL_URA_M[system], 1.0)
    usual_m = _RANGE_M[system]
    range_m = np.minimum(usual_m * worse, accuracy_m)
    code_m = np.minimum(_OTHER_CODE[signal], accuracy_m)
    return range_m, code_m, _RATE_MPS[system] * (range_m / usual_m)
