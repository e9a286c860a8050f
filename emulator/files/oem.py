"""Orbit ephemeris messages: states of one object in time, in either notation.

Sources: CCSDS 502.0-B-3 (Orbit Data Messages, 2023), 5 (OEM) and 7 (keyword = value notation); 505.0-B (XML)
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.files.text import FileError, read_text

TIME_SYSTEMS = {"UTC": None, "GPS": 0.0, "TAI": 19.0, "TT": 51.184}
"""Seconds ahead of GPS time; UTC by its leap seconds."""

_STATE = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
_NEEDED = ("OBJECT_NAME", "REF_FRAME", "TIME_SYSTEM")
_EARTH = ("EARTH", "399")
"""Values of CENTER_NAME that are the Earth: its name, and its number at JPL."""

_OTHERS = {
    "OPM": "one state",
    "OMM": "mean elements",
    "OCM": "an orbit in the comprehensive notation",
    "AEM": "attitudes",
    "APM": "one attitude",
    "ACM": "attitudes in the comprehensive notation",
    "CDM": "a conjunction",
    "TDM": "tracking data",
    "RDM": "a re-entry",
}
"""Messages of CCSDS that are no OEM, and what they tell."""

_VERSION = re.compile(r"\A\s*(?:COMMENT\b.*\s+)*CCSDS_([A-Z]{3})_VERS\b", re.I)
_ROOT = re.compile(r"\A\s*(?:<[?!][^>]*>\s*)*<(?:\w+:)?([a-z]{3})\b", re.I)
"""Beginning of a message in keyword notation, and in XML, with its kind."""

_COMMENT = re.compile(r"comment\b", re.I)
_USEABLE = ("USEABLE_START_TIME", "USEABLE_STOP_TIME")
_EPOCH = re.compile(r"(\d{4})-(?:(\d{2})-(\d{2})|(\d{3}))T(\d{2}):(\d{2})(?::(\d{2})(\.\d*)?)?Z?", re.I)


@dataclass(frozen=True, slots=True, eq=False)
class Ephemeris:
    """States of one object, by segments, which are not to be interpolated across; ascending within each.

    frame    as written, in capitals: EME2000, GCRF, ICRF, ITRF..., TEME
    t_ns     (n,) GPS time [ns]
    pos_m    (n, 3) [m] and
    vel_mps  (n, 3) [m/s], relative to the axes of the frame
    begins   rows where segments begin, the first being 0
    useable_ns   GPS time from which and until which each segment is for use [ns]; () as far as its states go
    """

    name: str
    frame: str
    t_ns: I64
    pos_m: F64
    vel_mps: F64
    begins: tuple[int, ...] = (0,)
    useable_ns: tuple[tuple[int, int], ...] = ()


def read(path: Path) -> Ephemeris:
    """The ephemeris of an OEM, keyword or XML, with all segments of its object.

    FileError with one line if it has faults.
    """
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> Ephemeris:
    """The ephemeris in the text of an OEM; `origin` names it in errors."""
    other = _VERSION.search(text) or _ROOT.search(text)
    if other is not None and other[1].upper() in _OTHERS:
        kind = other[1].upper()
        raise FileError(f"{origin}: is a CCSDS {kind}, {_OTHERS[kind]}; an OEM, states in time, is read")
    segments = list(_xml(text, origin) if text.lstrip().startswith("<") else _keywords(text, origin))
    if not segments:
        raise FileError(f"{origin}: no segment (META_START or <segment>)")
    for meta, _ in segments:
        _check(meta, origin)
    first = segments[0][0]
    for name in ("OBJECT_NAME", "REF_FRAME"):
        found = {meta[name].upper() for meta, _ in segments}
        if len(found) > 1:
            raise FileError(f"{origin}: {name} is {' and '.join(sorted(found))}; one is read")
    parts = [(_rows(meta, states, origin), meta) for meta, states in segments if states]
    parts.sort(key=lambda part: part[0][0][0])
    rows = [row for part, _ in parts for row in part]
    if len(rows) < 2:
        raise FileError(f"{origin}: {len(rows)} states; an orbit needs two at least")
    t_ns, states = np.array([row[0] for row in rows]), 1e3 * np.array([row[1:] for row in rows])
    lengths = [len(part) for part, _ in parts]
    begins = tuple(sum(lengths[:k]) for k in range(len(lengths)))
    useable_ns = tuple(_useable_ns(meta, part[0][0], part[-1][0], origin) for part, meta in parts)
    frame = first["REF_FRAME"].upper()
    return Ephemeris(first["OBJECT_NAME"], frame, t_ns, states[:, :3], states[:, 3:], begins, useable_ns)


def _check(meta: dict[str, str], origin: str) -> None:
    """FileError if a segment's metadata lack something, or say that its coordinates are not to be had so."""
    for name in _NEEDED:
        if name not in meta:
            raise FileError(f"{origin}: {name} is missing in the metadata")
    centre = meta.get("CENTER_NAME", "EARTH")
    if centre.upper() not in _EARTH:
        raise FileError(
            f"{origin}: CENTER_NAME is {centre}; states about the Earth's centre (EARTH) are read"
        )
    if "REF_FRAME_EPOCH" in meta and meta["REF_FRAME"].upper() == "TEME":
        raise FileError(
            f"{origin}: REF_FRAME_EPOCH is {meta['REF_FRAME_EPOCH']}; TEME is read as of each state's date"
        )


def _rows(meta: dict[str, str], states: list[_State], origin: str) -> list[tuple]:
    """A segment's states, ascending in time and each once: GPS time [ns], coordinates [km, km/s]."""
    rows = sorted({_row(meta, *state, origin) for state in states})
    twice = next((b for a, b in pairwise(rows) if a[0] == b[0]), None)
    if twice is not None:
        raise FileError(f"{origin}: two different states of one segment for {gpstime.iso(twice[0])} GPS")
    return rows


def _useable_ns(meta: dict[str, str], first_ns: int, last_ns: int, origin: str) -> tuple[int, int]:
    """Where a segment is for use: as far as its states go, if its metadata do not say less."""
    said = [
        _gps_ns(meta[key], meta["TIME_SYSTEM"].upper(), f"{origin}: {key}") if meta.get(key) else default
        for key, default in zip(_USEABLE, (first_ns, last_ns), strict=True)
    ]
    return max(said[0], first_ns), min(said[1], last_ns)


_State = tuple[int, str, list[str]]
"""Line (0 in XML), epoch and the six numbers as written [km], [km/s]."""


def _keywords(text: str, origin: str) -> Iterator[tuple[dict[str, str], list[_State]]]:
    """Metadata and states of the segments of the keyword notation."""
    meta: dict[str, str] | None = None
    states: list[_State] = []
    inside = covariance = False
    for n, line in enumerate(text.splitlines(), 1):
        word = line.strip()
        if not word or _COMMENT.match(word):
            continue
        if word.upper() in ("META_START", "COVARIANCE_START", "COVARIANCE_STOP", "META_STOP"):
            if word.upper() == "META_START":
                if meta is not None:
                    yield meta, states
                meta, states = {}, []
            inside = word.upper() == "META_START"
            covariance = word.upper() == "COVARIANCE_START"
        elif covariance:
            continue
        elif "=" in word:
            key, _, value = word.partition("=")
            if inside and meta is not None:
                meta[key.strip().upper()] = value.strip()
        elif meta is None:
            raise FileError(f"{origin}: line {n}: {word[:40]!r} before META_START")
        else:
            epoch, *numbers = word.split()
            if len(numbers) not in (6, 9):
                raise FileError(
                    f"{origin}: line {n}: {len(numbers)} numbers behind the epoch; allowed 6 or 9"
                )
            states.append((n, epoch, numbers[:6]))
    if meta is not None:
        yield meta, states


def _xml(text: str, origin: str) -> Iterator[tuple[dict[str, str], list[_State]]]:
    """Metadata and states of the segments of the XML notation."""
    if "<!DOCTYPE" in text:
        raise FileError(f"{origin}: a document type is declared; plain XML is read")
    try:
        root = ElementTree.fromstring(text.lstrip())
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise FileError(f"{origin}: not XML: {error}") from None
    for item in root.iter():
        # Which namespace a tag is in tells nothing: NDM/XML is written with and without one.
        item.tag = item.tag.rpartition("}")[2] if isinstance(item.tag, str) else item.tag
    # A container (NDM) may hold messages of other kinds beside.
    messages = list(root.iter("oem")) or [root]
    for segment in (segment for message in messages for segment in message.iter("segment")):
        meta = {item.tag: (item.text or "").strip() for item in segment.iterfind("metadata/*")}
        states = []
        for vector in segment.iterfind("data/stateVector"):
            _check_units(vector, origin)
            values = {item.tag: (item.text or "").strip() for item in vector}
            states.append((0, values.get("EPOCH", ""), [values.get(name, "") for name in _STATE]))
        yield meta, states


_UNITS = {name: ("km/s" if name.endswith("DOT") else "km") for name in _STATE}


def _check_units(vector: ElementTree.Element, origin: str) -> None:
    """FileError if a state is marked as of other units than those of the standard."""
    for item in vector:
        unit, wanted = item.get("units", ""), _UNITS.get(str(item.tag))
        if unit and wanted and unit.lower() != wanted:
            raise FileError(f"{origin}: units of {item.tag} are {unit!r}; allowed is {wanted}")


def _row(meta: dict[str, str], line: int, epoch: str, numbers: list[str], origin: str) -> tuple:
    where = f"{origin}: line {line}" if line else f"{origin}: state of {epoch or 'no epoch'}"
    values = []
    for name, text in zip(_STATE, numbers, strict=True):
        try:
            values.append(float(text))
        except ValueError:
            raise FileError(f"{where}: {name} is {text!r}, not a number") from None
        if not isfinite(values[-1]):
            raise FileError(f"{where}: {name} is {text!r}, not finite")
    return _gps_ns(epoch, meta["TIME_SYSTEM"].upper(), where), *values


def _gps_ns(text: str, system: str, where: str) -> int:
    """GPS time [ns] of an epoch as CCSDS writes it, by calendar date or day of the year."""
    match = _EPOCH.fullmatch(text)
    if system not in TIME_SYSTEMS:
        raise FileError(f"{where}: TIME_SYSTEM is {system}; allowed are {', '.join(TIME_SYSTEMS)}")
    wrong = FileError(f"{where}: {text!r} is not an epoch (YYYY-MM-DDThh:mm:ss.d)")
    if match is None:
        raise wrong
    try:
        year, month, day, of_year = (int(g) if g else 1 for g in match.groups()[:4])
        hour, minute, second = (int(g) if g else 0 for g in match.groups()[4:7])
        if not 1 <= of_year <= 366:
            raise ValueError(text)
        # A leap second, 23:59:60, is the one after 23:59:59.
        leap = second == 60
        moment = datetime(year, month, day, hour, minute, second - leap, tzinfo=UTC)
        moment += timedelta(days=of_year - 1)
    except ValueError:
        raise wrong from None
    fraction_ns = round((float(f"0{match[8] or '.'}0") + leap) * gpstime.NS_PER_S)
    ahead_s = TIME_SYSTEMS[system]
    try:
        whole_ns = gpstime.from_utc(moment) if ahead_s is None else gpstime.from_calendar(moment)
    except ValueError as error:
        raise FileError(f"{where}: {error}") from None
    return whole_ns + fraction_ns - round((ahead_s or 0.0) * gpstime.NS_PER_S)
