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
_EPOCH = re.compile(r"(\d{4})-(?:(\d{2})-(\d{2})|(\d{3}))T(\d{2}):(\d{2}):(\d{2})(\.\d+)?Z?")


@dataclass(frozen=True, slots=True, eq=False)
class Ephemeris:
    """States of one object, ascending in time.

    frame    as written: EME2000, GCRF, ICRF, ITRF..., TEME
    t_ns     (n,) GPS time [ns]
    pos_m    (n, 3) [m] and
    vel_mps  (n, 3) [m/s], relative to the axes of the frame
    """

    name: str
    frame: str
    t_ns: I64
    pos_m: F64
    vel_mps: F64


def read(path: Path) -> Ephemeris:
    """The ephemeris of an OEM, keyword or XML, gzip or plain; several segments of one object are joined.

    FileError with one line if it has faults.
    """
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> Ephemeris:
    """The ephemeris in the text of an OEM; `origin` names it in errors."""
    segments = list(_xml(text, origin) if text.lstrip().startswith("<") else _keywords(text, origin))
    if not segments:
        raise FileError(f"{origin}: no segment (META_START or <segment>)")
    for meta, _ in segments:
        for name in _NEEDED:
            if name not in meta:
                raise FileError(f"{origin}: {name} is missing in the metadata")
    first = segments[0][0]
    for name in ("OBJECT_NAME", "REF_FRAME"):
        found = {meta[name] for meta, _ in segments}
        if len(found) > 1:
            raise FileError(f"{origin}: {name} is {' and '.join(sorted(found))}; one is read")
    rows = sorted({_row(meta, *state, origin) for meta, states in segments for state in states})
    if len(rows) < 2:
        raise FileError(f"{origin}: {len(rows)} states; an orbit needs two at least")
    twice = next((b for a, b in pairwise(rows) if a[0] == b[0]), None)
    if twice is not None:
        raise FileError(f"{origin}: two different states for {gpstime.iso(twice[0])} GPS")
    t_ns, states = np.array([row[0] for row in rows]), 1e3 * np.array([row[1:] for row in rows])
    return Ephemeris(first["OBJECT_NAME"], first["REF_FRAME"].upper(), t_ns, states[:, :3], states[:, 3:])


_State = tuple[int, str, list[str]]
"""Line (0 in XML), epoch and the six numbers as written [km], [km/s]."""


def _keywords(text: str, origin: str) -> Iterator[tuple[dict[str, str], list[_State]]]:
    """Metadata and states of the segments of the keyword notation."""
    meta: dict[str, str] | None = None
    states: list[_State] = []
    inside = covariance = False
    for n, line in enumerate(text.splitlines(), 1):
        word = line.strip()
        if not word or word.startswith("COMMENT"):
            continue
        if word in ("META_START", "COVARIANCE_START", "COVARIANCE_STOP", "META_STOP"):
            if word == "META_START":
                if meta is not None:
                    yield meta, states
                meta, states = {}, []
            inside = word == "META_START"
            covariance = word == "COVARIANCE_START"
        elif covariance:
            continue
        elif "=" in word:
            key, _, value = word.partition("=")
            if inside and meta is not None:
                meta[key.strip()] = value.strip()
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
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise FileError(f"{origin}: not XML: {error}") from None
    for segment in root.iter("segment"):
        meta = {item.tag: (item.text or "").strip() for item in segment.iterfind("metadata/*")}
        states = []
        for vector in segment.iterfind("data/stateVector"):
            values = {item.tag: (item.text or "").strip() for item in vector}
            states.append((0, values.get("EPOCH", ""), [values.get(name, "") for name in _STATE]))
        yield meta, states


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
    return _gps_ns(epoch, meta["TIME_SYSTEM"], where), *values


def _gps_ns(text: str, system: str, where: str) -> int:
    """GPS time [ns] of an epoch as CCSDS writes it, by calendar date or day of the year."""
    match = _EPOCH.fullmatch(text)
    if system not in TIME_SYSTEMS:
        raise FileError(f"{where}: TIME_SYSTEM is {system}; allowed are {', '.join(TIME_SYSTEMS)}")
    wrong = FileError(f"{where}: {text!r} is not an epoch (YYYY-MM-DDThh:mm:ss.d)")
    if match is None:
        raise wrong
    try:
        year, month, day, of_year, hour, minute, second = (int(g) if g else 1 for g in match.groups()[:7])
        moment = datetime(year, month, day, hour, minute, second, tzinfo=UTC) + timedelta(days=of_year - 1)
    except ValueError:
        raise wrong from None
    fraction_ns = round(float(match[8] or 0) * gpstime.NS_PER_S)
    ahead_s = TIME_SYSTEMS[system]
    if ahead_s is None:
        return gpstime.from_utc(moment) + fraction_ns
    return gpstime.from_calendar(moment) + fraction_ns - round(ahead_s * gpstime.NS_PER_S)
