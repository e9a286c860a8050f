"""Constellations from navigation files, as a scenario names them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from dbc import gpstime
from emulator.files import rinex_nav
from emulator.files.rinex_layouts import LAYOUTS
from emulator.files.text import FileError
from emulator.scenario import ScenarioError, Time
from emulator.world import glonass, gps
from emulator.world.constellation import Array, Constellation

_MAKERS: dict[str, tuple[str, Callable[[rinex_nav.Records, Array], Constellation]]] = {
    "gps": ("G", lambda records, glonass_to_utc_s: gps.from_records(records)),
    "glonass": ("R", glonass.from_records),
}
"""System -> RINEX letter and maker from records and each record's -tau_c [s]."""


def from_files(system: str, paths: Sequence[Path], time: Time) -> Constellation:
    """The constellation of a system in navigation files that together cover the run.

    Raises ScenarioError with one line: a file's fault, no record of the system, or both spans.
    """
    letter, make = _MAKERS[system]
    if not paths:
        raise ScenarioError(f"sky.{system}: no navigation file is named; 'none' leaves the system out")
    try:
        files = [rinex_nav.read(path) for path in paths]
    except FileError as error:
        raise ScenarioError(f"sky.{system}: {error}") from None
    having = [file for file in files if letter in file.records]
    names = ", ".join(map(str, paths))
    if not having:
        raise ScenarioError(f"sky.{system}: {names}: no {LAYOUTS[letter].name} record")
    parts = [file.records[letter] for file in having]
    to_utc_s = np.repeat([file.glonass_to_utc_s for file in having], [len(part) for part in parts])
    constellation = make(_joined(parts), to_utc_s)
    first_ns, last_ns = constellation.span_ns
    end_ns = time.start_ns + (time.epochs - 1) * time.interval_ns
    if time.start_ns < first_ns or end_ns > last_ns:
        raise ScenarioError(
            f"sky.{system}: {names}: ephemerides from {gpstime.iso(first_ns)} to {gpstime.iso(last_ns)}; "
            f"the run is from {gpstime.iso(time.start_ns)} to {gpstime.iso(end_ns)} (GPS time)"
        )
    return constellation


def _joined(parts: Sequence[rinex_nav.Records]) -> rinex_nav.Records:
    return rinex_nav.Records(
        np.concatenate([part.number for part in parts]),
        tuple(chain.from_iterable(part.epoch for part in parts)),
        {name: np.concatenate([part.fields[name] for part in parts]) for name in parts[0].fields},
    )
