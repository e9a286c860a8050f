"""Constellations as a scenario names them: nominal ones, and those of navigation files and precise orbits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.counts import noun, so_many
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.config.tables import ScenarioError, Tell, Time, untold
from gnss_hil.emulator.constellation import precise_sky, presence
from gnss_hil.emulator.constellation.base import Constellation, Spanned
from gnss_hil.emulator.constellation.precise_sky import Orbits
from gnss_hil.emulator.constellation.registry import MAKERS
from gnss_hil.emulator.files import rinex_nav
from gnss_hil.emulator.files.rinex_layouts import LAYOUTS
from gnss_hil.emulator.files.text import FileError, read_text


def from_files(system: str, paths: Sequence[Path], time: Time, tell: Tell = untold) -> Constellation:
    """The constellation of a system in files that together cover the run: navigation messages, or SP3.

    tell  takes remarks
    Raises ScenarioError with one line: a file's fault, no record of the system, or both spans.
    """
    key = f"sky.{system}"
    if not paths:
        raise ScenarioError(f"{key}: no navigation file is named; 'none' leaves the system out")
    precise = [_is_sp3(path, key) for path in paths]
    if all(precise):
        return precise_sky.constellation(
            precise_orbits(key, paths, time, tell, SYSTEMS[system].value), SYSTEMS[system].value
        )
    if any(precise):
        raise ScenarioError(f"{key}: {', '.join(map(str, paths))}: navigation messages or SP3, not both")
    constellation = _broadcast(system, paths, key, tell)
    _check_span(constellation.span_ns, time, f"{key}: {', '.join(map(str, paths))}: ephemerides")
    return constellation


def nominal(system: str, start_ns: int) -> Constellation:
    """The slots of a system, every one taken; ScenarioError if no maker of them is known."""
    row = MAKERS.get(system)
    if row is None:
        raise ScenarioError(f"sky.{system}: no nominal constellation of {system} is known")
    return row.nominal(start_ns)


def precise_orbits(
    key: str, paths: Sequence[Path], time: Time, tell: Tell = untold, system: int | None = None
) -> Orbits:
    """Orbits of SP3 files that together cover the run; ScenarioError with one line under `key`.

    system  the one whose oddities are told, None: of all
    """
    names = ", ".join(map(str, paths))
    try:
        product, orbits = precise_sky.read(paths, gpstime.to_calendar(time.start_ns).date())
    except FileError as error:
        raise ScenarioError(f"{key}: {error}") from None
    except ValueError as error:
        raise ScenarioError(f"{key}: {names}: {error}") from None
    _check_span(orbits.span_ns, time, f"{key}: {names}: orbits")
    for remark in presence.of_product(product, orbits, *time.span_ns, system):
        tell(f"{key}: {names}: {remark}")
    return orbits


def _is_sp3(path: Path, key: str) -> bool:
    try:
        return read_text(Path(path)).startswith("#")
    except FileError as error:
        raise ScenarioError(f"{key}: {error}") from None


def _broadcast(system: str, paths: Sequence[Path], key: str, tell: Tell) -> Spanned:
    letter, row = SYSTEMS[system].letter, MAKERS.get(system)
    if row is None or row.from_records is None:
        raise ScenarioError(f"{key}: navigation messages of {system} are not read")
    try:
        files = [rinex_nav.read(path) for path in paths]
    except FileError as error:
        raise ScenarioError(f"{key}: {error}") from None
    having = [file for file in files if letter in file.records]
    if not having:
        names = ", ".join(map(str, paths))
        raise ScenarioError(f"{key}: {names}: no {LAYOUTS[letter].name} record")
    parts = [file.records[letter] for file in having]
    to_utc_s = np.repeat([file.glonass_to_utc_s for file in having], [len(part) for part in parts])
    joined = _joined(parts)
    for remark in _odd(joined, sum(file.placeless.get(letter, 0) for file in files), letter):
        tell(f"{key}: {', '.join(map(str, paths))}: {remark}")
    return row.from_records(joined, to_utc_s)


def _odd(records: rinex_nav.Records, placeless: int, letter: str) -> Iterator[str]:
    """What is odd about the records of a system, a line each."""
    if placeless:
        name = LAYOUTS[letter].name
        many = f"{so_many(placeless, 'record')} of {name} {noun(placeless, 'is', 'are')}"
        yield f"{many} left out: their places or clocks are zero or unknown"
    rivals = rinex_nav.rivals(records)
    if rivals:
        names = ", ".join(f"{letter}{number:02d}" for number in rivals)
        yield f"different messages of one time of {names}: the last one read counts"


def _check_span(span_ns: tuple[int, int], time: Time, what: str) -> None:
    (first_ns, last_ns), (begin_ns, end_ns) = span_ns, time.span_ns
    if begin_ns < first_ns or end_ns > last_ns:
        raise ScenarioError(
            f"{what} from {gpstime.iso(first_ns)} to {gpstime.iso(last_ns)}; "
            f"the run is from {gpstime.iso(begin_ns)} to {gpstime.iso(end_ns)} (GPS time)"
        )


def _joined(parts: Sequence[rinex_nav.Records]) -> rinex_nav.Records:
    return rinex_nav.Records(
        np.concatenate([part.number for part in parts]),
        tuple(chain.from_iterable(part.epoch for part in parts)),
        {name: np.concatenate([part.fields[name] for part in parts]) for name in parts[0].fields},
    )
