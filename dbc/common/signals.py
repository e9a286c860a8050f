"""Ranging signals of the navigation systems: one row each, a satellite may be tracked on several.

What depends on a signal reads it here; what only the emulated transmitters know (power) is theirs, keyed by
the signal's name (`gnss_hil.emulator.signal.powers`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import systems
from gnss_hil.dbc.common.registry import table
from gnss_hil.dbc.common.systems import SYSTEMS, System

COUNT = 16
"""Signals that the contract's four bits can name."""


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal.

    name         label of the contract's table "Signal"
    system       name of its system
    value        on the bus, 0..15
    carrier_hz   carrier, of frequency number 0 where there are several [Hz]
    spacing_hz   step of one frequency number [Hz], 0 where satellites share the carrier
    chip_hz      chipping rate of the ranging code [1/s]
    rinex        band and tracking attribute of RINEX 3 ("1C": C1C, L1C, D1C, S1C)
    group_delay  item of the navigation message with the delay of this signal: "tgd" against the pair that
                 broadcast clocks belong to, it grows with 1 / carrier^2; "delta_tau" against the system's
                 first signal; "" where there is none
    clock_code   signal whose code the broadcast clocks belong to, if this one's may differ from it by a
                 constant of the satellite; "" else
    """

    name: str
    system: str
    value: int
    carrier_hz: float
    spacing_hz: float
    chip_hz: float
    rinex: str
    group_delay: str = ""
    clock_code: str = ""
    source: str = ""


_IS = "IS-GPS-200, 3.3.1.1, 3.3.2.1 and 20.3.3.3.3.2"
_IS5 = "IS-GPS-705, 3.3.1.1 and 3.3.2.1"
_ICD = "GLONASS ICD 5.1 (2008), 3.3.1.1 and 3.3.2"
_OS = "Galileo OS SIS ICD 2.1, 2.1 and 2.3.1"

SIGNALS: dict[str, Signal] = table(
    Signal("L1CA", "gps", 0, 1_575.42e6, 0.0, 1.023e6, "1C", "tgd", "L1P", _IS),
    Signal("L1P", "gps", 2, 1_575.42e6, 0.0, 10.23e6, "1W", "tgd", source=_IS),
    Signal("L5", "gps", 5, 1_176.45e6, 0.0, 10.23e6, "5Q", "tgd", "L1P", _IS5),
    Signal("L2C", "gps", 4, 1_227.60e6, 0.0, 1.023e6, "2X", "tgd", "L2P", _IS),
    Signal("L2P", "gps", 3, 1_227.60e6, 0.0, 10.23e6, "2W", "tgd", source=_IS),
    Signal("L1OF", "glonass", 1, 1_602.0e6, 562.5e3, 0.511e6, "1C", source=_ICD),
    Signal("L2OF", "glonass", 6, 1_246.0e6, 437.5e3, 0.511e6, "2C", "delta_tau", source=_ICD),
    Signal("E1", "galileo", 7, 1_575.42e6, 0.0, 1.023e6, "1X", "bgd_e5b", source=_OS),
)  # fmt: skip
"""By name; of each system in the order in which a receiver of one signal prefers them: the first band before
others, there the code that is open."""


def by_value(value: int) -> Signal | None:
    """The signal with this number on the bus, None if no row has it."""
    return next((signal for signal in SIGNALS.values() if signal.value == value), None)


def of_system(system: System) -> tuple[Signal, ...]:
    """Signals of a system, the preferred one first."""
    return tuple(signal for signal in SIGNALS.values() if signal.system == system.name)


def column(of: Callable[[Signal], Any], missing: Any) -> NDArray:
    """A property of all signals as (COUNT,) over values on the bus; `missing` where there is no row."""
    values = [missing] * COUNT
    for signal in SIGNALS.values():
        values[signal.value] = of(signal)
    return np.array(values)


def first_column(of: Callable[[Signal], Any], missing: Any) -> NDArray:
    """A property of each system's preferred signal as (8,) over systems' numbers on the bus; `missing` where
    a system has no signal."""
    values = [missing] * systems.COUNT
    for system in SYSTEMS.values():
        for signal in of_system(system)[:1]:
            values[system.value] = of(signal)
    return np.array(values)


def beyond_first() -> NDArray[np.int64]:
    """(COUNT,) by value on the bus: 0 of each system's first signal, the value itself of all others."""
    firsts = {signal.value for system in SYSTEMS.values() for signal in of_system(system)[:1]}
    return np.array([0 if value in firsts else value for value in range(COUNT)])


def has_frequency_numbers() -> NDArray[np.bool_]:
    """(8,) by system: whether satellites have carriers of their own, by frequency number."""
    return first_column(lambda signal: signal.spacing_hz != 0, False)
