"""Which observation codes of RINEX make up a signal of the contract: a table.

Version 2 names an observable by kind and band, version 3 by kind, band and attribute. A signal's codes are
tried from left to right; the first pseudorange a file has decides, phase, Doppler and strength follow it.
Sources: RINEX 2.11, table A1; RINEX 3.05, tables 4 and 5; LA, SA: JPL's names for C/A phase and strength
"""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.messages import VALUES
from gnss_hil.emulator.signal.bands import G1_HZ, G1_STEP_HZ, L1_HZ

GPS, GLONASS = satellites.GPS, satellites.GLONASS

_NUMBER = {label: raw for raw, label in VALUES["Signal"].items()}


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
    """A signal: its number in the contract's table "Signal", carrier of frequency number 0 and step of one
    number [Hz], and the ways of naming it."""

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


def _signal(name: str, system: int, carrier_hz: float, spacing_hz: float, *codes: Codes) -> Signal:
    return Signal(name, _NUMBER[name], system, carrier_hz, spacing_hz, codes)


SIGNALS = {
    signal.name: signal
    for signal in (
        _signal("L1CA", GPS, L1_HZ, 0.0, *_three("1", "C"), _two("C1", "1", "A")),
        _signal("L1P", GPS, L1_HZ, 0.0, *_three("1", "WPY"), _two("P1", "1")),
        _signal("L2P", GPS, 1_227.60e6, 0.0, *_three("2", "WPYD"), _two("P2", "2")),
        _signal("L2C", GPS, 1_227.60e6, 0.0, *_three("2", "XLSC"), _two("C2", "2")),
        _signal("L1OF", GLONASS, G1_HZ, G1_STEP_HZ, *_three("1", "CP"), _two("C1", "1")),
        _signal("L2OF", GLONASS, 1_246.0e6, 437.5e3, *_three("2", "CP"), _two("C2", "2"), _two("P2", "2")),
    )
}
"""By name. Carriers: IS-GPS-200, 3.3.1.1; GLONASS ICD 5.1, 3.3.1.1."""
