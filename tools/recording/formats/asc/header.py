"""Lines of an ASC file that are no events: date, base of numbers, kind of time stamps, trigger blocks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime

_MONTHS = {
    "jan": 1, "feb": 2, "fev": 2, "fév": 2, "mar": 3, "mär": 3, "mrz": 3, "apr": 4, "avr": 4, "may": 5,
    "mai": 5,
    "jun": 6, "juin": 6, "jul": 7, "juil": 7, "aug": 8, "aou": 8, "aoû": 8, "sep": 9, "oct": 10, "okt": 10,
    "nov": 11, "dec": 12, "dez": 12, "déc": 12,
}  # fmt: skip
"""In English, German and French: programs write their user's language."""
_CLOCK = re.compile(r"([0-9]{1,2}):([0-9]{1,2}):([0-9]{1,2})(?:[.,:]([0-9]{1,9}))?$")
_LOOSE = re.compile(r"[0-9]{1,4}[.,]?$")
_WHOLE_DATES = (re.compile(r"(?P<y>[0-9]{4})[-/](?P<m>[0-9]{1,2})[-/](?P<d>[0-9]{1,2})$"),
                re.compile(r"(?P<d>[0-9]{1,2})\.(?P<m>[0-9]{1,2})\.(?P<y>[0-9]{4})$"))  # fmt: skip
_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Date:
    """unix_ns  the instant, local time taken for what it says where this program runs (as Vector has it)
    of_day_ns  since its midnight
    """

    unix_ns: int
    of_day_ns: int


def month(word: str) -> int | None:
    """The month of its name, whole or cut."""
    word = word.lower().rstrip(".")
    found = [_MONTHS[word[:n]] for n in (4, 3) if word[:n] in _MONTHS]
    return found[0] if found and word.isalpha() else None


def date_of(text: str) -> Date | None:
    """The date of 'Wed Oct 31 12:15:00.000 am 2012' and its relatives: names in other languages, 24 hours, no
    fraction, whole dates as numbers. None if it is none."""
    clock = numbers = half = month_number = None
    loose: list[int] = []
    for word in text.replace("T", " ", 1).split() if text[:1].isdigit() else text.split():
        if match := _CLOCK.match(word):
            clock = match
        elif match := next((m for pattern in _WHOLE_DATES if (m := pattern.match(word))), None):
            numbers = int(match["y"]), int(match["m"]), int(match["d"])
        elif word.lower() in ("am", "pm", "a.m.", "p.m."):
            half = word[0].lower()
        elif _LOOSE.match(word):
            loose.append(int(word.rstrip(".,")))
        else:
            month_number = month(word) or month_number
    if numbers is None and month_number is not None and len(loose) == 2:
        day, year = sorted(loose)
        numbers = year, month_number, day
    return None if clock is None or numbers is None else _at(numbers, clock, half)


def _at(numbers: tuple[int, int, int], clock: re.Match[str], half: str | None) -> Date | None:
    hour, minute, second = (int(clock[i]) for i in (1, 2, 3))
    if half == "a" and hour == 12:
        hour = 0
    elif half == "p" and hour < 12:
        hour += 12
    if not 1970 <= numbers[0] < 2100:
        return None
    try:
        whole_s = datetime(*numbers, hour, minute, second).timestamp()
    except (ValueError, OverflowError, OSError):
        return None
    fraction_ns = int((clock[4] or "0").ljust(9, "0"))
    return Date(int(whole_s) * _NS + fraction_ns, ((hour * 60 + minute) * 60 + second) * _NS + fraction_ns)


@dataclass(slots=True)
class Header:
    """What the lines without a time have said so far.

    base      of identifiers, lengths and payloads: 16 or 10
    relative  times count from the event before
    stamps    the base line says how they count (BUSMASTER's does not)
    date      of the header, None before or if there is none that can be understood
    block     of the last trigger block
    odd_date  a date that was not understood
    """

    base: int = 16
    relative: bool = False
    stamps: bool = False
    date: Date | None = None
    block: Date | None = None
    odd_date: str = ""

    def hear(self, line: str) -> str | None:
        """Take a line without a time; its kind, "" if it is part of every file, None if unknown."""
        words = line.lower().split()
        if not words:
            return ""
        if line.lstrip().startswith("//"):
            return "" if words[0] == "//" and words[1:2] == ["version"] else "comments"
        if words[0] == "date":
            self.date = self._date(line) or self.date
        elif words[0] == "base":
            self.base = 10 if words[1:2] == ["dec"] else 16
            self.stamps = "timestamps" in words
            self.relative = "relative" in words
        elif words[:2] == ["begin", "triggerblock"]:
            self.block = self._date(line) if len(words) > 3 else None
        elif words[:2] != ["end", "triggerblock"] and "events logged" not in " ".join(words):
            return None
        return ""

    def _date(self, line: str) -> Date | None:
        keywords = 2 if line.split()[0].lower() == "begin" else 1
        text = " ".join(line.split()[keywords:])
        date = date_of(text)
        if date is None:
            self.odd_date = self.odd_date or text
        return date
