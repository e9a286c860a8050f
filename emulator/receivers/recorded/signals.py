"""Which observation codes of RINEX make up a signal of the contract: a table.

Version 2 names an observable by kind and band, version 3 by kind, band and attribute. A signal's codes are
tried from left to right; the first pseudorange a file has decides, phase, Doppler and strength follow it.
Sources: RINEX 2.11, table A1; RINEX 3.05, tables 4 and 5; LA, SA: JPL's names for C/A phase and strength
"""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.systems import SYSTEMS


@dataclass(frozen=True, slots=True)
class Codes:
    """One way in which a file may name the observables of a signal; phase, Doppler and strength may each
    have several names, of which the first in the file counts."""

    range: str
    phase: tuple[str, ...]
    doppler: tuple[str, ...]
    strength: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Signal:
    """A row of the contract's table of signals, by numbers of the bus, and its names in files."""

    name: str
    number: int
    system: int
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
    "L1OF": (*_three("1", "CP"), _two("C1", "1")),
    "L2OF": (*_three("2", "CP"), _two("C2", "2"), _two("P2", "2")),
}
"""By the signal's name; the first is what the signal is written as."""


def _signal(name: str, codes: tuple[Codes, ...]) -> Signal:
    row = signals.SIGNALS[name]
    return Signal(name, row.value, SYSTEMS[row.system].value, row.carrier_hz, row.spacing_hz, codes)


SIGNALS = {name: _signal(name, codes) for name, codes in _CODES.items()}
"""By name."""
