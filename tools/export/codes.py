"""Signals of the bus under RINEX's names."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.export.run_data import Rows


@dataclass(frozen=True, slots=True, eq=False)
class Codes:
    """The observables of some rows.

    types      RINEX letter of a system -> its codes: C, L, D, S of one signal after another
    first      (k,) place of the row's first code in its system's
    wave_m     (k,) carrier wavelength
    """

    types: dict[str, tuple[str, ...]]
    first: NDArray[np.int64]
    wave_m: NDArray[np.float64]


def codes_of(rows: Rows) -> Codes:
    """RINEX codes of all signals in the rows; Mistake for one that has none here."""
    system = satellites.system_of(rows.sat)
    pairs = sorted(set(zip(system.tolist(), rows.signal.tolist(), strict=True)))
    types: dict[str, tuple[str, ...]] = {}
    first, wave_m = np.zeros(len(rows), np.int64), np.zeros(len(rows))
    for number, raw in pairs:
        signal, row = signals.by_value(raw), systems.by_value(number)
        if signal is None or row is None or signal.system != row.name:
            label, name = signal.name if signal else raw, row.name if row else number
            known = ", ".join(signals.SIGNALS)
            raise Mistake(f"signal {label} of system {name} has no RINEX code; known are {known}")
        known = types.get(row.letter, ())
        mine = (system == number) & (rows.signal == raw)
        first[mine] = len(known)
        wave_m[mine] = LIGHT_MPS / (signal.carrier_hz + signal.spacing_hz * rows.frequency[mine])
        types[row.letter] = (*known, *(kind + signal.rinex for kind in "CLDS"))
    return Codes(types, first, wave_m)
