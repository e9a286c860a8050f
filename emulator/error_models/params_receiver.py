"""Parameters of the receivers' errors.

Formulas stand in `emulator.clocks.oscillator`, `.slips`, `.windup`, `.biases` and
`emulator.receivers.emulated.data_collection`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.emulator.error_models.params import Factor


class ClockInstability(Factor):
    """Free oscillators in place of the bounded wander, one for each clock domain.

    oscillator     class: see `emulator.clocks.oscillator.OSCILLATORS`
    offset_ms      1 sigma of the time error at the start (modelled)
    frequency_ppb  1 sigma of the frequency error at the start, 1e-9 (modelled)
    reset_ms       a clock more than half of this off is set back by it; 0: never
    """

    oscillator: Literal["tcxo-low", "tcxo", "ocxo", "csac", "rb"] = "tcxo"
    offset_ms: Annotated[float, Field(ge=0, le=10)] = 0.1
    frequency_ppb: Annotated[float, Field(ge=0, le=2000)] = 20.0
    reset_ms: Annotated[float, Field(ge=0, le=100)] = 0.0


class CycleSlips(Factor):
    """Slips of the carrier loops.

    costas     loops that ignore the data's sign, whose slips are half cycles; else whole ones
    per_hour   slips of every channel that nothing here causes (modelled)
    """

    costas: bool = True
    per_hour: Annotated[float, Field(ge=0, le=3600)] = 0.0


class LossOfLock(Factor):
    """Signals too weak for the loops, by the rules of thumb of Kaplan & Hegarty, 3rd ed., 8.9.

    stress_deg, stress_chips   steady errors of the loops under the craft's motion
    """

    stress_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    stress_chips: Annotated[float, Field(ge=0, le=0.5)] = 0.0


class PhaseWindup(Factor):
    """Turns of the transmitting and receiving antennas about the way of the signal; no parameters."""


class InterchannelBias(Factor):
    """Delays of a receiver that differ with GLONASS frequency, in code; and of the receiver as a whole.

    slope_m_per_channel   1 sigma over receivers of what a frequency number adds [m]
    scatter_m             1 sigma of each frequency number's own
    hardware_m            1 sigma of the delay common to all signals of a receiver
    Slope and scatter are fitted: two receivers differ as those of the links OP-PTB and SU-PTB do, by -2.2 to
    2.5 ns for 20 satellites, in Jiang & Lewandowski, Int. J. Navigation Observ. (2012) 353961, table 7. Two
    pairs that share a receiver tell a slope to a factor of two at best; the common delay is modelled
    """

    slope_m_per_channel: Annotated[float, Field(ge=0, le=10)] = 0.02
    scatter_m: Annotated[float, Field(ge=0, le=100)] = 0.16
    hardware_m: Annotated[float, Field(ge=0, le=1000)] = 3.0


class DataCollection(Factor):
    """How long an ephemeris takes to be collected, by the frames of the messages, in place of one fixed time.

    shared  the receivers of a craft tell each other what they have collected
    """

    shared: bool = True
