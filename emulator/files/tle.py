"""Two-line element sets: which object's, and whether the lines are whole.

Source: D. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., 2.4.2 (columns and checksum)
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gnss_hil.emulator.files.text import FileError, read_text

_LENGTH = 69


@dataclass(frozen=True, slots=True)
class ElementSet:
    """name (empty if the file gives none) and the two lines."""

    name: str
    line1: str
    line2: str


def read(path: Path) -> list[ElementSet]:
    """The element sets of a file; FileError with one line if it has faults."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> list[ElementSet]:
    """The element sets in the text of a file, with or without lines of names; `origin` names it in errors."""
    found, name, first = [], "", ""
    for n, line in enumerate(text.splitlines(), 1):
        line = line.rstrip()
        if first:
            found.append(ElementSet(name, first, _checked(line, "2", n, origin)))
            if found[-1].line2[2:7] != first[2:7]:
                raise FileError(f"{origin}: line {n}: object is {line[2:7]!r}; line 1 says {first[2:7]!r}")
            name = first = ""
        elif line.startswith("1 ") and len(line) >= _LENGTH:
            first = _checked(line, "1", n, origin)
        elif line:
            name = line.removeprefix("0 ").strip()
    if first or not found:
        raise FileError(f"{origin}: {'line 2 of the last set is missing' if first else 'no element set'}")
    return found


def _checked(line: str, number: str, n: int, origin: str) -> str:
    if not line.startswith(f"{number} ") or len(line) != _LENGTH:
        raise FileError(f"{origin}: line {n}: not line {number} of an element set ({_LENGTH} columns)")
    total = sum(int(c) if c.isdigit() else c == "-" for c in line[:-1]) % 10
    if line[-1] != str(total):
        raise FileError(f"{origin}: line {n}: checksum is {line[-1]!r}; the line sums up to {total}")
    return line


def choose(sets: list[ElementSet], name: str | None, origin: str) -> ElementSet:
    """The set of an object by name or catalogue number; of one without either if it is alone."""
    if name is None and len(sets) == 1:
        return sets[0]
    for candidate in sets:
        if name in (candidate.name, candidate.line1[2:7].strip()):
            return candidate
    known = ", ".join(s.name or s.line1[2:7].strip() for s in sets[:12])
    asked = "object is missing" if name is None else f"object is {name!r}"
    raise FileError(f"{origin}: {asked}; the file has {known}")
