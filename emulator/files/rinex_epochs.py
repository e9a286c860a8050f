"""Where in a RINEX observation file which satellite's observations stand.

Epochs can only be found one after another, since each has the number of its lines; these are read all
at once elsewhere.
Sources: RINEX 2.11, table A2; RINEX 3.05, table A3
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from math import nan

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.files.columns import Lines
from gnss_hil.emulator.files.rinex_obs_header import Header, changed_definition, satellite_index
from gnss_hil.emulator.files.text import FileError

_SATELLITES_PER_LINE_2, _PER_LINE_2 = 12, 5
_ON_ONE_LINE = 1_000_000
"""Version 3 writes a satellite's observations on one line, however many."""

_EVENTS = (2, 3, 4, 5)
"""Epoch flags of records that are no observations but header lines; 6 has cycle slips instead."""
_SLIPS = 6

_TICKS_PER_S = 10_000_000
"""Epochs are written to 0.1 us."""

_BDT_S = 14
"""GPS - BDT. BeiDou ICD B1I 3.0, 3.3."""


@dataclass(frozen=True, slots=True, eq=False)
class Epochs:
    """Where observations stand.

    t_ns, clock_s   (e,) see `rinex_obs.Observations`
    epoch, sat      (p,) see there
    line            (p,) first line, 0-based, of a satellite's observations
    per_line, indent   observations on a line, and columns in front of the first
    passed          see there
    """

    t_ns: I64
    clock_s: F64
    epoch: I64
    sat: I64
    line: I64
    per_line: int
    indent: int
    passed: dict[str, I64]


class _Scan:
    """A walk through the epochs of a file."""

    def __init__(self, lines: Lines, header: Header, start: int):
        self.lines, self.header, self.at = lines.text, header, start
        self.origin = lines.origin
        self.known: dict[str, int | None] = {}
        self.t_ns: list[int] = []
        self.clock_s: list[float] = []
        self.rows: list[tuple[int, int, int]] = []
        self.passed: dict[str, list[int]] = {}

    def refuse(self, line: int, what: str) -> FileError:
        return FileError(f"{self.origin}: line {line + 1}: {what}")

    def whole(self, text: str, name: str, most: int) -> int:
        if text.strip().isdecimal() and int(text) <= most:
            return int(text)
        raise self.refuse(self.at, f"{name} is '{text}'; allowed is 0 to {most}")

    def begin(self, date: str, clock: str) -> None:
        """An epoch of observations."""
        try:
            t_ns = _moment_ns(date, self.header.scale)
        except ValueError:
            raise self.refuse(self.at, f"epoch is '{date.strip()}'; no such moment") from None
        if self.t_ns and t_ns <= self.t_ns[-1]:
            raise self.refuse(self.at, f"epoch is '{date.strip()}'; it does not follow the one before it")
        self.t_ns.append(t_ns)
        self.clock_s.append(self.offset_s(clock.strip()))

    def offset_s(self, text: str) -> float:
        """The receiver's clock offset, nan where it is not given."""
        try:
            # Python, unlike Fortran, reads digits grouped by underscores, and words.
            if set(text) <= set("+-.0123456789"):
                return float(text or nan)
        except ValueError:
            pass
        raise self.refuse(self.at, f"receiver clock offset is '{text}'; not a number")

    def satellite(self, name: str, name_line: int, line: int) -> None:
        """A satellite of the epoch begun last, its observations from `line` on."""
        if name not in self.known:
            try:
                self.known[name] = satellite_index(name, self.header.system)
            except ValueError as error:
                raise self.refuse(name_line, str(error)) from None
        index = self.known[name]
        if index is not None:
            self.rows.append((len(self.t_ns) - 1, index, line))
        else:
            self.passed.setdefault(name[:1].strip() or self.header.system, []).append(len(self.t_ns) - 1)

    def ends_at(self, end: int, what: str) -> None:
        if end > len(self.lines):
            raise self.refuse(len(self.lines) - 1, f"file ends inside {what} from line {self.at + 1}")

    def skip_event(self, count: int) -> None:
        """Header lines among the observations: passed over, unless they change how to read on."""
        self.ends_at(self.at + 1 + count, "the event record")
        lines = [(n + 1, self.lines[n]) for n in range(self.at + 1, self.at + 1 + count)]
        changed = changed_definition(self.header, lines, self.origin)
        if changed is not None:
            raise self.refuse(changed[0] - 1, f"{changed[1]} changes here; files are read in which it stays")
        self.at += 1 + count

    def result(self, per_line: int, indent: int) -> Epochs:
        rows = np.array(self.rows, np.int64).reshape(-1, 3)
        epoch, sat, line = rows.T
        pair = epoch * (1 << 10) + sat
        order = np.argsort(pair, kind="stable")
        twice = np.flatnonzero(np.diff(pair[order]) == 0)
        if len(twice):
            raise self.refuse(int(line[order[twice[0] + 1]]), "the epoch has this satellite already")
        passed = {letter: np.array(epochs, np.int64) for letter, epochs in self.passed.items()}
        t_ns, clock_s = np.array(self.t_ns, np.int64), np.array(self.clock_s)
        return Epochs(t_ns, clock_s, epoch, sat, line, per_line, indent, passed)


def _moment_ns(date: str, scale: str) -> int:
    """GPS time [ns] of an epoch as written; ValueError if there is none."""
    *day, seconds = date.split()
    year, month, day_of_month, hour, minute = map(int, day)
    if year < 100:
        year += 1900 if year >= 80 else 2000
    whole, _, rest = seconds.partition(".")
    ticks = int(whole) * _TICKS_PER_S + int(rest[:7].ljust(7, "0"))
    if not 0 <= ticks <= 60 * _TICKS_PER_S:
        raise ValueError(seconds)
    start = datetime(year, month, day_of_month, hour, minute)
    # GLONASS time in RINEX is UTC. RINEX 3.05, 4.1.2
    start_ns = gpstime.from_utc(start) if scale == "GLO" else gpstime.from_calendar(start)
    return start_ns + (_BDT_S * gpstime.NS_PER_S if scale == "BDT" else 0) + ticks * 100


def _version_2(lines: Lines, header: Header, start: int) -> Epochs:
    scan = _Scan(lines, header, start)
    per_satellite = -(-len(header.codes[""]) // _PER_LINE_2)
    while scan.at < len(scan.lines):
        head = scan.lines[scan.at]
        if not head.strip():
            scan.at += 1
            continue
        # A blank flag is 0, as Fortran reads it.
        flag = scan.whole(head[28:29].strip() or "0", "epoch flag", _SLIPS)
        count = scan.whole(head[29:32], "number of satellites", 999)
        if flag in _EVENTS:
            scan.skip_event(count)
            continue
        name_lines = max(1, -(-count // _SATELLITES_PER_LINE_2))
        first = scan.at + name_lines
        scan.ends_at(first + count * per_satellite, "the epoch")
        if flag != _SLIPS:
            scan.begin(head[:26], head[68:80])
            for k in range(count):
                down, across = divmod(k, _SATELLITES_PER_LINE_2)
                name_line, place = scan.at + down, 32 + 3 * across
                name = scan.lines[name_line][place : place + 3].ljust(3)
                scan.satellite(name, name_line, first + k * per_satellite)
        scan.at = first + count * per_satellite
    return scan.result(_PER_LINE_2, 0)


def _version_3(lines: Lines, header: Header, start: int) -> Epochs:
    scan = _Scan(lines, header, start)
    while scan.at < len(scan.lines):
        head = scan.lines[scan.at]
        if not head.strip():
            scan.at += 1
            continue
        if head[0] != ">":
            raise scan.refuse(scan.at, f"'{head[:20]}' is not the beginning of an epoch, which is '>'")
        flag = scan.whole(head[31:32].strip() or "0", "epoch flag", _SLIPS)
        count = scan.whole(head[32:35], "number of satellites", 999)
        if flag in _EVENTS:
            scan.skip_event(count)
            continue
        first = scan.at + 1
        scan.ends_at(first + count, "the epoch")
        if flag != _SLIPS:
            scan.begin(head[1:29], head[41:56])
            for line in range(first, first + count):
                scan.satellite(scan.lines[line][:3].ljust(3), line, line)
        scan.at = first + count
    return scan.result(_ON_ONE_LINE, 3)


EPOCHS: tuple[Callable[[Lines, Header, int], Epochs], ...] = (_version_2, _version_3)
"""How a file of version 2, and one of a later version, is walked through."""
