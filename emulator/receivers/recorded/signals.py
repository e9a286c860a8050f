"""Which observation codes of RINEX make up a signal of the contract: a table.

Version 2 names an observable by kind and band, version 3 by kind, band and attribute. Which of a signal's
codes count: `gnss_hil.emulator.receivers.recorded.observables`.
Sources: RINEX 2.11, table A1; RINEX 3.05, tables 4 and 5; LA, SA: JPL's names for C/A phase and strength
"""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.systems import SYSTEMS


@dataclass(frozen=True, slots=True)
class Codes:
    """One way in which a file may name the observables of a signal; phase, Doppler and strength may each
    have several names."""

    range: str
    phase: tuple[str, ...]
    doppler: tuple[str, ...]
    strength: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Signal:
    """A row of the contract's table of signals, by numbers of the bus, and its names in files; its band by
    RINEX."""

    name: str
    number: int
    system: int
    band: str
    carrier_hz: float
    spacing_hz: float
    codes: tuple[Codes, ...]


def _three(band: str, attributes: str) -> tuple[Codes, ...]:
    """Names of version 3 by tracking attribute, in order of preference."""
    return tuple(
        Codes(f"C{band}{a}", (f"L{band}{a}",), (f"D{band}{a}",), (f"S{band}{a}",)) for a in attributes
    )


def _two(code: str, band: str, own: str = "") -> Codes:
    """Names of version 2: the band's own, before them a signal's own letter."""
    names = (own, band) if own else (band,)
    return Codes(code, *(tuple(kind + name for name in names) for kind in "LDS"))


_CODES: dict[str, tuple[Codes, ...]] = {
    "L1CA": (*_three("1", "C"), _two("C1", "1", "A")),
    "L1P": (*_three("1", "WPY"), _two("P1", "1")),
    "L2P": (*_three("2", "WPYD"), _two("P2", "2")),
    "L2C": (*_three("2", "XLSC"), _two("C2", "2")),
    "L5": (*_three("5", "QXI"), _two("C5", "5")),
    "L1OF": (*_three("1", "CP"), _two("C1", "1"), _two("P1", "1")),
    "L2OF": (*_three("2", "CP"), _two("C2", "2"), _two("P2", "2")),
}
"""By the signal's name; the first is what the signal is written as."""


def _signal(name: str, codes: tuple[Codes, ...]) -> Signal:
    row = signals.SIGNALS[name]
    system = SYSTEMS[row.system].value
    return Signal(name, row.value, system, row.rinex[0], row.carrier_hz, row.spacing_hz, codes)


SIGNALS = {name: _signal(name, codes) for name, codes in _CODES.items()}
"""By name."""


def band_of(name: str) -> str:
    """Band of an observable by its name in files: "1" of L1, L1C and LA."""
    return "1" if name[1:2] == "A" else name[1:2]


def carriers(system: int) -> dict[str, Signal]:
    """Bands of a system of which there are signals, each with one of them: its carrier is that of all."""
    return {signal.band: signal for signal in SIGNALS.values() if signal.system == system}
