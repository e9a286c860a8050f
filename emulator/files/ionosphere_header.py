"""The coefficients of the broadcast ionosphere model in the header of a RINEX navigation file.

CODE's files of fitted coefficients (CGIM) have the same form.
Sources: RINEX 2.11, table A3 (ION ALPHA, ION BETA: 2X, 4D12.4); RINEX 3.05, table A5 (IONOSPHERIC CORR, GPSA
and GPSB: A4, 1X, 4D12.4)
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from gnss_hil.emulator.files.text import FileError, read_text

# Label in columns 61 to 80, beginning of the line, column of the first number.
_FORMS = {
    "alpha": (("ION ALPHA", "", 2), ("IONOSPHERIC CORR", "GPSA", 5)),
    "beta": (("ION BETA", "", 2), ("IONOSPHERIC CORR", "GPSB", 5)),
}
_WIDTH = 12
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([DdEe][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class IonosphereHeader:
    """alpha, beta (4,) as broadcast, in powers of semicircles [s]."""

    alpha: tuple[float, ...]
    beta: tuple[float, ...]


def read(path: Path) -> IonosphereHeader:
    """The coefficients in a file's header, gzip or plain; FileError with one line if there are none."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> IonosphereHeader:
    """The coefficients in the text of a file; `origin` names it in errors."""
    lines = text.splitlines()
    if "RINEX VERSION / TYPE" not in lines[0][60:].upper():
        raise FileError(f"{origin}: line 1: not a RINEX file (no RINEX VERSION / TYPE in columns 61-80)")
    end = next((n for n, line in enumerate(lines) if line[60:].upper().startswith("END OF HEADER")), None)
    if end is None:
        raise FileError(f"{origin}: line {len(lines)}: file ends inside the header")
    found = {name: _four(lines[:end], name, origin) for name in _FORMS}
    if not any(any(four) for four in found.values()):
        raise FileError(f"{origin}: all coefficients of the ionosphere are 0: none were received")
    return IonosphereHeader(**found)


def _four(header: list[str], name: str, origin: str) -> tuple[float, ...]:
    for label, start, column in _FORMS[name]:
        for n, line in enumerate(header, 1):
            if line[60:].upper().startswith(label) and line.startswith(start):
                cells = [line[c : c + _WIDTH] for c in range(column, column + 4 * _WIDTH, _WIDTH)]
                return tuple(
                    _number(cell.strip(), f"{start or label} {k}", n, origin) for k, cell in enumerate(cells)
                )
    labels = " or ".join(f"{label} {start}".strip() for label, start, _ in _FORMS[name])
    raise FileError(f"{origin}: header has no {labels}: no coefficients of the ionosphere")


def _number(cell: str, name: str, line: int, origin: str) -> float:
    if not _NUMBER.fullmatch(cell):
        raise FileError(f"{origin}: line {line}: {name} is {cell!r}, not a number")
    return float(cell.upper().replace("D", "E"))
