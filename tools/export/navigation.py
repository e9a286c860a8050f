"""The navigation file: what the satellites broadcast, and whether the bus agrees with it.

The bus carries satellites' coordinates, not their messages. The messages are those of the scenario's sky; if
a third party's emulator flew another sky, or error factors falsify what receivers report, the file and the
bus differ, which is measured and reported.
Source: RINEX 3.04 (IGS/RTCM, 2018), tables A5, A6, A10
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isnan
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.assemble.shared import models_of_sky, report_errors
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.emulator.constellation.base import Constellation, ReportErrors
from gnss_hil.emulator.constellation.nominal_messages import Stretch
from gnss_hil.emulator.constellation.precise_sky import PreciseConstellation
from gnss_hil.emulator.constellation.registry import MAKERS, records_of
from gnss_hil.emulator.constellation.sources import from_files, nominal
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.files.rinex_layouts import UNKNOWN
from gnss_hil.emulator.files.rinex_nav import Records
from gnss_hil.tools.export.rinex_systems import navigation_lines, opening
from gnss_hil.tools.export.rinex_text import comments, labelled, leap_seconds
from gnss_hil.tools.export.run_data import CraftData

_LONGEST_FLIGHT_NS = gpstime.NS_PER_S // 2
_COMPARED = 2000
"""Rows of a craft that are held against the file."""

_PRECISE = "precise orbits have no messages"
_NO_MAKER = "no messages of it are made"


def messages(
    sky: Mapping[str, Constellation],
    span_ns: tuple[int, int],
    wgs84: bool,
    errors: Mapping[str, Sequence[ReportErrors]] | None = None,
) -> dict[str, Records]:
    """Records by RINEX letter that serve a span of epochs, of those systems whose satellites have any.

    errors  by letter, what nominal satellites report too much
    """
    first, last = span_ns
    stretch = Stretch(first - _LONGEST_FLIGHT_NS, last + _LONGEST_FLIGHT_NS)
    made = {
        system.letter: records_of(
            system.name, sky[system.letter], stretch, wgs84, (errors or {}).get(system.letter, ())
        )
        for system in SYSTEMS.values()
        if system.letter in sky
    }
    return {letter: records for letter, records in made.items() if records is not None}


def without_messages(sky: Mapping[str, Constellation], found: Mapping[str, Records]) -> str:
    """Which systems of the sky have no records, and why; empty if all have."""
    names = [
        f"{system.name} ({_PRECISE if isinstance(sky[system.letter], PreciseConstellation) else _NO_MAKER})"
        for system in SYSTEMS.values()
        if system.letter in sky and system.letter not in found
    ]
    return ", ".join(names)


def span_ns(data: Sequence[CraftData]) -> tuple[int, int]:
    """First and last mark of all craft [ns]."""
    return min(int(h.t_ns[0]) for h in data), max(int(h.t_ns[-1]) for h in data)


def constellations(scenario: Scenario) -> dict[str, Constellation]:
    """The scenario's satellites by RINEX letter; ScenarioError if they cannot be had."""
    found = {}
    for system, source in scenario.sky.sources().items():
        letter = SYSTEMS[system].letter
        if source == "nominal":
            found[letter] = nominal(system, scenario.time.start_ns)
        elif source != "none":
            paths = [Path(name) for name in ([source] if isinstance(source, str) else source)]
            found[letter] = from_files(system, paths, scenario.time)
    return found


def errors_of(scenario: Scenario, sky: Mapping[str, Constellation]) -> dict[str, list[ReportErrors]]:
    """What the scenario's satellites report too much, by RINEX letter; ScenarioError if it cannot be had."""
    return {letter: report_errors(models_of_sky(scenario, Path, one.index)) for letter, one in sky.items()}


def text_of(found: Mapping[str, Records], t_ns: int, wgs84: bool, about: str = "") -> Iterator[str]:
    """The navigation file of all systems, by time.

    t_ns   an instant that tells the leap seconds
    about  a comment
    """
    yield opening("N: GNSS NAV DATA", "".join(found))
    yield comments(about)
    yield from navigation_lines("".join(found), wgs84)
    yield leap_seconds(t_ns)
    yield labelled("", "END OF HEADER")
    for letter, rows in found.items():
        order = sorted(range(len(rows)), key=lambda i, r=rows: (r.epoch[i], r.number[i]))
        values = np.stack(list(rows.fields.values()), axis=-1)
        for i in order:
            yield _record(letter, int(rows.number[i]), rows.epoch[i], values[i].tolist())


def _record(letter: str, number: int, epoch, values: list[float]) -> str:
    cells = [f"{UNKNOWN if isnan(v) else v:19.12E}".replace("E", "D") for v in values]
    lines = [f"{letter}{number:02d} {epoch:%Y %m %d %H %M %S}" + "".join(cells[:3])]
    lines += ["    " + "".join(cells[at : at + 4]) for at in range(3, len(cells), 4)]
    return "\n".join(lines) + "\n"


def disagreement_m(found: Mapping[str, Records], data: CraftData) -> float | None:
    """Median distance between satellites as reported on the bus and by WGS-84 records [m]; None if there is
    nothing to compare.

    A median, because the emulator changes messages on whole minutes and readers of the file half-way between
    two: for seconds the two may use different ones, metres apart. The transmission instant is what
    receiver and satellite themselves tell: tag - (P + clock) / c.
    """
    tagged = np.flatnonzero(data.tagged)
    rows = data.rows[tagged[:: max(1, len(tagged) // _COMPARED)]]
    tag_ns = data.tag_ns(rows.epoch, rows.receiver)
    sent_ns = tag_ns - np.rint((rows.pseudorange_m + rows.clock_m) / LIGHT_MPS * 1e9).astype(np.int64)
    number = satellites.number_of(rows.sat)
    apart_m = [
        np.linalg.norm(row.places(found[letter], number[mine], sent_ns[mine]) - rows.pos_sv_m[mine], axis=1)
        for name, row in MAKERS.items()
        if (letter := SYSTEMS[name].letter) in found
        and row.places is not None
        and (mine := np.isin(rows.sat, satellites.index(SYSTEMS[name].value, found[letter].number))).any()
    ]
    return float(np.median(np.concatenate(apart_m))) if apart_m else None
