"""The motion of a craft, however its scenario states it: computed, or read from a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.config import tables as scenario
from gnss_hil.emulator.config.tables import ScenarioError, Tell, untold
from gnss_hil.emulator.files import csv_table, oem, tle
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.orbits import tabulated, trajectory
from gnss_hil.emulator.orbits.dynamics import CraftState, build_orbit
from gnss_hil.emulator.orbits.tabulated import Span, Wanted
from gnss_hil.emulator.orbits.trajectory import Segments, Trajectory, TrajectoryError

_METRES = {"m": 1.0, "km": 1e3, "ft": 0.3048}
_AXES = tuple(f"position_{axis}" for axis in "xyz")


class Motion(Protocol):
    """Where a craft is: at a GPS time, and over several (q,)."""

    def at(self, t_ns: int) -> CraftState: ...

    def over(self, t_ns: I64) -> CraftState: ...


OLD_ELEMENTS_NS = gpstime.NS_PER_DAY
"""Two-line elements this far from a run are told."""

Flown = Trajectory | Segments


@dataclass(frozen=True, slots=True)
class Asked:
    """What a reader is asked.

    name, given   the file, and what else the scenario says of it
    span_ns       the run
    measured      the Earth's orientation, None without a file of it
    whole         whether the run needs all of the orbit;  tell takes remarks
    """

    name: str
    given: scenario.TrajectoryFile
    span_ns: Span
    measured: Orientation | None
    whole: bool
    tell: Tell

    @property
    def of_a_table(self) -> Wanted:
        return Wanted(self.name, self.measured, self.span_ns, self.tell, self.whole)


Maker = Callable[[Asked], Flown]


def _oem(asked: Asked) -> Segments:
    message = oem.read(Path(asked.name))
    return tabulated.of_ephemeris(message, asked.of_a_table)


def _tle(asked: Asked) -> Trajectory:
    begin_ns, end_ns = asked.span_ns
    sets = tle.read(Path(asked.name))
    chosen = tle.choose(sets, asked.given.object, asked.name, (begin_ns + end_ns) // 2)
    if others := tle.rivals(sets, chosen):
        epoch = gpstime.iso(chosen.epoch_ns)[:19]
        asked.tell(f"{asked.name}: {others + 1} different element sets of epoch {epoch}: the last one counts")
    age_ns = max(abs(begin_ns - chosen.epoch_ns), abs(end_ns - chosen.epoch_ns))
    if age_ns > OLD_ELEMENTS_NS:
        epoch, days = gpstime.iso(chosen.epoch_ns)[:19], age_ns / gpstime.NS_PER_DAY
        said = f"{asked.name}: elements of epoch {epoch}, {days:.1f} days from the run"
        asked.tell(f"{said}: SGP4 is off by 1 to 3 km a day")
    return trajectory.of_elements(chosen.line1, chosen.line2, begin_ns, end_ns, asked.measured)


def _csv(asked: Asked) -> Segments:
    table = csv_table.read(Path(asked.name), _AXES)
    pos_m = _METRES[asked.given.unit] * table.columns
    return tabulated.of_table(table.t_ns, pos_m, "J2000", asked.of_a_table)


KINDS: dict[str, Maker] = {"oem": _oem, "tle": _tle, "csv": _csv}
"""Kind of file -> its trajectory over a run."""


def read_trajectory(
    given: scenario.TrajectoryFile,
    span_ns: Span,
    measured: Orientation | None,
    key: str,
    tell: Tell,
    whole: bool = True,
) -> Flown:
    """The trajectory a scenario names for a run; ScenarioError with one line under `key` if there is none.

    measured  the Earth's orientation, None without a file of it
    tell      takes remarks
    whole     the run needs all of it; else gaps between the segments of a message are told, and what lies
              before or after all of them is the caller's to tell
    """
    kind, name = next((kind, name) for kind in KINDS if (name := getattr(given, kind)) is not None)
    try:
        asked = Asked(name, given, span_ns, measured, whole, lambda remark: tell(f"{key}: {remark}"))
        found = KINDS[kind](asked)
        found.check(*span_ns, name, whole)
    except (FileError, TrajectoryError) as error:
        raise ScenarioError(f"{key}: {error}") from None
    return found


def build_motion(
    name: str,
    orbit: scenario.Orbit | None,
    file: scenario.TrajectoryFile | None,
    time: scenario.Time,
    measured: Orientation | None,
    tell: Tell = untold,
) -> Motion:
    """The motion of a craft by its orbit or by a file; ScenarioError with one line if there is none."""
    if file is not None:
        return read_trajectory(file, time.span_ns, measured, f"craft.{name}.trajectory", tell)
    if orbit is None:
        raise ScenarioError(f"craft.{name}: has neither an orbit nor a trajectory")
    return build_orbit(orbit, time.start_ns)
