"""Headers of RINEX observation files, versions 2 to 4: label by label, into one record.

Other labels are skipped.
Sources: RINEX 2.11 (Gurtner & Estey, 2007), table A1; RINEX 3.05 (IGS/RTCM, 2020), table A2
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import Any

import numpy as np

from gnss_hil.dbc.common import satellites, systems
from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.emulator.files.text import FileError

OLDEST, NEWEST = 2.0, 5.0
"""Versions [OLDEST, NEWEST) are read. Version 4 changed observation files in their codes only."""

TIME_SCALES = ("GPS", "GLO", "GAL", "QZS", "BDT", "IRN")
_SCALE_OF_SYSTEM = {"G": "GPS", "R": "GLO", "E": "GAL", "J": "QZS", "C": "BDT", "I": "IRN", "S": "GPS"}
"""Time scale of a file of one system that names none. RINEX 3.05, table A2, TIME OF FIRST OBS."""

_PER_LINE_2, _PER_LINE_3 = 9, 13
"""Codes on a line of # / TYPES OF OBSERV and of SYS / # / OBS TYPES."""

MOST_CODES = 200

_NO_FREQUENCY = ("", "99")
"""Ways to write that a slot's frequency number is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class Header:
    """What a file says before its observations.

    version
    system          RINEX letter of all its satellites, M for several systems
    codes           RINEX letter -> observation codes in file order; version 2 has one list, under ""
    scale           time scale of its epochs, TIME_SCALES
    marker, receiver, antenna   names; the latter two are types
    position_ecef_m (3,) approximate, nan where not given (or given as zeros, as for moving receivers)
    delta_hen_m     (3,) antenna over marker: height, east, north
    interval_s      nan where not given
    clock_applied   epochs and observations are already free of the receiver's clock offset
    wave_factors    (2,) of L1 and L2: 2 where the receiver squared, 0 where there is no L2
    wave_factors_of satellite index -> the same, of those that differ
    scale_factors   RINEX letter and code -> what observations were multiplied by
    frequencies     GLONASS slot -> frequency number
    strength_unit   of signal strengths, such as DBHZ; "" where not given
    """

    version: float
    system: str
    codes: Mapping[str, tuple[str, ...]]
    scale: str
    marker: str = ""
    receiver: str = ""
    antenna: str = ""
    position_ecef_m: F64 = field(default_factory=lambda: np.full(3, nan))
    delta_hen_m: F64 = field(default_factory=lambda: np.zeros(3))
    interval_s: float = nan
    clock_applied: bool = False
    wave_factors: tuple[int, int] = (1, 1)
    wave_factors_of: Mapping[int, tuple[int, int]] = field(default_factory=dict)
    scale_factors: Mapping[tuple[str, str], float] = field(default_factory=dict)
    frequencies: Mapping[int, int] = field(default_factory=dict)
    strength_unit: str = ""


class _Draft:
    """A header as it grows.

    fields  of the Header, as far as they are known
    wanted  RINEX letter -> number of codes announced
    letter, factor   system and scale factor that continuation lines go on with
    """

    def __init__(self, origin: str):
        self.origin = origin
        self.line = 1
        self.fields: dict[str, Any] = {
            name: {} for name in ("codes", "wave_factors_of", "scale_factors", "frequencies")
        }
        self.wanted: dict[str, int] = {}
        self.letter = ""
        self.factor = 1.0

    def refuse(self, what: str) -> FileError:
        return FileError(f"{self.origin}: line {self.line}: {what}")

    def number(self, text: str, name: str, kind: type = float, least: float = -1e8, most: float = 1e8) -> Any:
        """A number of the header, or the error that names it."""
        try:
            value = kind(text)
        except ValueError:
            value = nan
        # Python, unlike Fortran, reads digits grouped by underscores.
        if "_" in text or not least <= value <= most:
            raise self.refuse(f"{name} is '{text.strip()}'; allowed is a number from {least:g} to {most:g}")
        return value


def satellite_index(text: str, system: str) -> int | None:
    """Index of a satellite as RINEX writes it, None of a system the bench does not know.

    system  RINEX letter of the file: what a blank instead of a letter means, GPS in a file of several
    ValueError where the text is no satellite at all.
    """
    letter = text[0].upper().replace(" ", "G" if system == "M" else system)
    name = letter + text[1:].replace(" ", "0")
    if systems.by_letter(letter):
        return satellites.parse(name)
    if len(name) == 3 and letter.isupper() and name[1:].isdecimal():
        return None
    raise ValueError(f"'{text}' is not a satellite name such as G07 or R21")


def _name(key: str, start: int, end: int) -> Callable[[_Draft, str], None]:
    def keep(draft: _Draft, line: str) -> None:
        draft.fields[key] = line[start:end].strip()

    return keep


def _vector(key: str, label: str) -> Callable[[_Draft, str], None]:
    def keep(draft: _Draft, line: str) -> None:
        parts = (line[c : c + 14] for c in (0, 14, 28))
        draft.fields[key] = np.array([draft.number(part, label) for part in parts])

    return keep


def _codes_2(draft: _Draft, line: str) -> None:
    _more_codes(draft, line[:6], line[6:60].upper().split(), _PER_LINE_2)


def _codes_3(draft: _Draft, line: str) -> None:
    draft.letter = line[0].strip().upper() or draft.letter
    _more_codes(draft, line[3:6], line[6:60].upper().split(), _PER_LINE_3)


def _more_codes(draft: _Draft, count: str, codes: list[str], per_line: int) -> None:
    """A line of codes: the first one of a system has their number."""
    letter, so_far = draft.letter, ()
    if count.strip():
        draft.wanted[letter] = draft.number(count, "number of observation codes", int, 1, MOST_CODES)
    else:
        so_far = draft.fields["codes"].get(letter, ())
    both = (*so_far, *codes)
    wanted = draft.wanted.get(letter, 0)
    if len(set(both)) < len(both) or len(both) != min(wanted, len(so_far) + per_line):
        raise draft.refuse(
            f"observation codes are '{' '.join(both)}'; {wanted} different ones were announced"
        )
    draft.fields["codes"][letter] = both


def _first_epoch(draft: _Draft, line: str) -> None:
    scale = line[48:51].strip().upper()
    if scale not in ("", *TIME_SCALES):
        raise draft.refuse(f"time system is '{scale}'; allowed is {', '.join(TIME_SCALES)}")
    draft.fields["scale"] = scale


def _interval(draft: _Draft, line: str) -> None:
    # What does not count forward stands for none: epochs say when they are.
    interval_s = draft.number(line[:10].strip() or "0", "INTERVAL")
    draft.fields["interval_s"] = interval_s if interval_s > 0 else nan


def _clock_applied(draft: _Draft, line: str) -> None:
    draft.fields["clock_applied"] = draft.number(line[:6], "RCV CLOCK OFFS APPL", int, 0, 1) == 1


def _wave_factors(draft: _Draft, line: str) -> None:
    label = "WAVELENGTH FACT L1/2"
    factors = tuple(draft.number(line[c : c + 6].strip() or "0", label, int, 0, 2) for c in (0, 6))
    names = [line[c : c + 3] for c in range(21, 60, 6) if line[c : c + 3].strip()]
    if not names:
        draft.fields["wave_factors"] = factors
    for name in names:
        try:
            index = satellite_index(name, draft.fields["system"])
        except ValueError as error:
            raise draft.refuse(f"{label}: {error}") from None
        if index is not None:
            draft.fields["wave_factors_of"][index] = factors


def _scale_factor(draft: _Draft, line: str) -> None:
    if line[0].strip():
        draft.letter = line[0].upper()
        draft.factor = draft.number(line[2:6], "SYS / SCALE FACTOR", int, 1, 10_000)
    codes = line[10:60].upper().split() or draft.fields["codes"].get(draft.letter, ())
    draft.fields["scale_factors"].update({(draft.letter, code): float(draft.factor) for code in codes})


def _frequencies(draft: _Draft, line: str) -> None:
    for c in range(4, 60, 7):
        if line[c : c + 3].strip():
            slot = draft.number(line[c + 1 : c + 3], "GLONASS SLOT", int, 1, 63)
            cell = line[c + 4 : c + 6]
            # A satellite whose frequency is needed and not known is told elsewhere.
            if cell.strip() not in _NO_FREQUENCY:
                number = draft.number(cell, "GLONASS FRQ #", int, -7, 13)
                draft.fields["frequencies"][slot] = number


def _strength_unit(draft: _Draft, line: str) -> None:
    draft.fields["strength_unit"] = line[:20].strip().upper()


DEFINITIONS: dict[str, Callable[[_Draft, str], None]] = {
    "# / TYPES OF OBSERV": _codes_2,
    "SYS / # / OBS TYPES": _codes_3,
    "SYS / SCALE FACTOR": _scale_factor,
}
"""Labels of lines that say how observations are to be read."""

_LABELS: dict[str, Callable[[_Draft, str], None]] = DEFINITIONS | {
    "MARKER NAME": _name("marker", 0, 60),
    "REC # / TYPE / VERS": _name("receiver", 20, 40),
    "ANT # / TYPE": _name("antenna", 20, 40),
    "APPROX POSITION XYZ": _vector("position_ecef_m", "APPROX POSITION XYZ"),
    "ANTENNA: DELTA H/E/N": _vector("delta_hen_m", "ANTENNA: DELTA H/E/N"),
    "GLONASS SLOT / FRQ #": _frequencies,
    "INTERVAL": _interval,
    "TIME OF FIRST OBS": _first_epoch,
    "RCV CLOCK OFFS APPL": _clock_applied,
    "WAVELENGTH FACT L1/2": _wave_factors,
    "SIGNAL STRENGTH UNIT": _strength_unit,
}


def _label(line: str) -> str:
    return line[60:80].strip().upper()


def parse_header(lines: list[str], origin: str) -> tuple[Header, int]:
    """The header at the beginning of a file, and the number of its lines."""
    draft = _Draft(origin)
    _version(draft, lines[0])
    for n, line in enumerate(lines[1:], 2):
        draft.line = n
        label = _label(line)
        if label == "END OF HEADER":
            return _finished(draft), n
        if label in _LABELS:
            _LABELS[label](draft, line)
    raise FileError(f"{origin}: line {len(lines)}: file ends inside the header")


def changed_definition(
    header: Header, lines: Sequence[tuple[int, str]], origin: str
) -> tuple[int, str] | None:
    """Line and label of the first definition among header lines (number from 1, text) if together they say
    something else than the header of the file; None where they repeat it."""
    draft = _Draft(origin)
    draft.fields.update(codes=dict(header.codes), scale_factors=dict(header.scale_factors))
    draft.wanted = {letter: len(codes) for letter, codes in header.codes.items()}
    first = None
    for draft.line, line in lines:
        label = _label(line)
        if label in DEFINITIONS:
            first = first or (draft.line, label)
            DEFINITIONS[label](draft, line)
    same = draft.fields["codes"] == header.codes and draft.fields["scale_factors"] == header.scale_factors
    return None if same else first


def _version(draft: _Draft, line: str) -> None:
    if not _label(line).startswith("RINEX VERSION / TYPE"):
        raise draft.refuse("not a RINEX file (no RINEX VERSION / TYPE in columns 61-80)")
    version = draft.number(line[:9], "RINEX version", float, 0)
    if not OLDEST <= version < NEWEST:
        raise draft.refuse(f"RINEX version is {version:.2f}; 2, 3 and 4 are read")
    if line[20:21].upper() != "O":
        raise draft.refuse(f"file type is '{line[20:40].strip()}'; observation data is O")
    draft.fields.update(version=version, system=line[40:41].strip().upper() or "G")


def _finished(draft: _Draft) -> Header:
    fields, old = draft.fields, draft.fields["version"] < 3
    if set(fields["codes"]) != {""} if old else "" in fields["codes"] or not fields["codes"]:
        label = "# / TYPES OF OBSERV" if old else "SYS / # / OBS TYPES"
        raise draft.refuse(f"observation codes are missing; version {fields['version']:.2f} has {label}")
    for letter, codes in fields["codes"].items():
        if len(codes) < draft.wanted[letter]:
            raise draft.refuse(
                f"{so_many(len(codes), 'observation code was', 'observation codes were')} read; "
                f"{so_many(draft.wanted[letter], 'was', 'were')} announced"
            )
    fields["scale"] = fields.get("scale") or _SCALE_OF_SYSTEM.get(fields["system"], "GPS")
    if not fields.get("position_ecef_m", np.zeros(3)).any():
        fields["position_ecef_m"] = np.full(3, nan)
    return Header(**fields)
