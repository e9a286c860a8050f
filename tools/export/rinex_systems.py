"""What RINEX asks of single satellite systems: names in a first line, and header lines of their own.

Source: RINEX 3.04 (IGS/RTCM, 2018), tables A2 (observation header) and A5 (navigation header)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.registry import table
from gnss_hil.dbc.common.systems import SYSTEMS, System, by_letter
from gnss_hil.tools.common.errors import PROGRAM
from gnss_hil.tools.export.rinex_text import VERSION, comments, labelled
from gnss_hil.tools.export.run_data import Rows

IN_WGS84 = """GLONASS states are WGS-84, which the receivers report, not PZ-90: a program that takes them as
they are, without a transformation, gets the coordinates of the bus."""
IN_PZ90 = "GLONASS states are PZ-90 as of their date."


def _nothing(*_: object) -> Iterator[str]:
    return iter(())


@dataclass(frozen=True, slots=True)
class SystemHeader:
    """What is special of one system.

    name          of the system
    label         in the first line of a file that holds no other system
    observation   the system and its rows -> lines of an observation header
    navigation    whether states are WGS-84 -> lines of a navigation header
    """

    name: str
    label: str
    observation: Callable[[System, Rows], Iterator[str]] = _nothing
    navigation: Callable[[bool], Iterator[str]] = _nothing


def _frequency_numbers(system: System, rows: Rows) -> Iterator[str]:
    """Frequency numbers by slot, eight a line; code-phase biases: none is known of any receiver here."""
    slots = satellites.number_of(rows.sat).tolist()
    numbers = sorted(dict(zip(slots, rows.frequency.tolist(), strict=True)).items())
    for at in range(0, len(numbers), 8):
        count = f"{len(numbers):3d}" if at == 0 else "   "
        pairs = "".join(f" {system.letter}{slot:02d} {k:2d}" for slot, k in numbers[at : at + 8])
        yield labelled(count + pairs, "GLONASS SLOT / FRQ #")
    yield labelled("".join(f" {code} {'':8}" for code in ("C1C", "C1P", "C2C", "C2P")), "GLONASS COD/PHS/BIS")


def _datum_and_time(wgs84: bool) -> Iterator[str]:
    """Which frame the states are in; the records' clocks hold the correction to UTC, which is zero here."""
    yield comments(IN_WGS84 if wgs84 else IN_PZ90)
    yield labelled(f"GLUT {0:17.10E}{0:16.9E}{0:7d}{0:5d}".replace("E", "D"), "TIME SYSTEM CORR")


HEADERS: dict[str, SystemHeader] = table(
    SystemHeader("gps", "GPS"),
    SystemHeader("glonass", "GLONASS", _frequency_numbers, _datum_and_time),
    SystemHeader("beidou", "BDS"),
    SystemHeader("qzss", "QZSS"),
    SystemHeader("sbas", "SBAS Payload"),
)
"""By name of the system; one without a row has its capitalised name and no lines of its own."""


def header_of(system: System) -> SystemHeader:
    return HEADERS.get(system.name) or SystemHeader(system.name, system.name.capitalize())


def opening(kind: str, letters: str) -> str:
    """First two lines of a file; letters of the systems in it."""
    only = by_letter(letters) if len(letters) == 1 else None
    system = f"{only.letter}: {header_of(only).label}" if only else "M: MIXED"
    now = f"{datetime.now(UTC):%Y%m%d %H%M%S} UTC"
    return labelled(f"{VERSION:9.2f}{'':11}{kind:<20}{system:<20}", "RINEX VERSION / TYPE") + labelled(
        f"{PROGRAM:<20}{'':20}{now:<20}", "PGM / RUN BY / DATE"
    )


def observation_lines(letters: str, rows: Rows) -> Iterator[str]:
    """Header lines that single systems among the letters ask for."""
    value = satellites.system_of(rows.sat)
    for system in SYSTEMS.values():
        if system.letter in letters:
            yield from header_of(system).observation(system, rows[value == system.value])


def navigation_lines(letters: str, wgs84: bool) -> Iterator[str]:
    """The same of a navigation file; wgs84: states in WGS-84 instead of the system's own frame."""
    for system in SYSTEMS.values():
        if system.letter in letters:
            yield from header_of(system).navigation(wgs84)
