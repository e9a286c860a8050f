"""What a run is asked for, in records that nothing changes: from a command line, a study or a program.

Nothing heavy is imported here: the command line makes these records before it knows what they need.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gnss_hil.dbc.process.command_line import Value

OURS, EXTERNAL = "ours", "external"
"""Whose software is on a side of the bus: ours, or one that is started elsewhere; else a command to start."""

OTHER_SIDE = {"emulator": "flight", "flight": "emulator"}
"""Who receives the side that is played."""


@dataclass(frozen=True, slots=True)
class Overrides:
    """What is changed of a scenario before it is checked; None, False and empty leave it as it is.

    nav, sp3     navigation files and precise orbits: together the sky
    obs, reference, ionosphere_free   of a recorded receiver
    options      of the flight software, in the order in which they were given
    sets         any keys by their paths, and values, as typed; after all the others
    on, off      error models switched, "all" among them; a name counts more than "all"
    attitudes    number of a craft -> its [craft.attitude]
    fault_files, faults   fault files, and faults of one line, behind those of the scenario
    """

    duration_s: float | None = None
    interval_s: float | None = None
    seed: int | None = None
    nav: tuple[Path, ...] = ()
    sp3: tuple[Path, ...] = ()
    obs: Path | None = None
    reference: Path | None = None
    ionosphere_free: bool = False
    vehicle: str | None = None
    policy: str | None = None
    navigator: str | None = None
    options: tuple[tuple[str, Value], ...] = ()
    autonomous: str | None = None
    sets: tuple[tuple[str, str], ...] = ()
    on: tuple[str, ...] = ()
    off: tuple[str, ...] = ()
    attitudes: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    fault_files: tuple[Path, ...] = ()
    faults: tuple[str, ...] = ()


UNCHANGED = Overrides()


@dataclass(frozen=True, slots=True)
class RunConfig:
    """A scenario played into a run folder, as `gnss-hil run` has it.

    command   the command line, for the record
    seeds     a run of each, in folders of their own; none: one run
    wait_s    for the first sign of the other side; None: a minute, of one that is started elsewhere for ever
    """

    scenario: str
    overrides: Overrides = UNCHANGED
    pace: str = "lockstep"
    bus: str = "embedded"
    flight: str = OURS
    emulator: str = OURS
    out: Path | None = None
    junit: Path | None = None
    log: bool = True
    report: bool = True
    plain: bool = False
    quiet: bool = False
    command: str = ""
    seeds: tuple[int, ...] = ()
    wait_s: float | None = None


@dataclass(frozen=True, slots=True)
class ReplayConfig:
    """A recording played again, as `gnss-hil replay` has it.

    only              the side that is played, None: every frame at its recorded time
    flight, emulator  whose software is on the other side; None where there is no such side
    pace              None: the emulator on the bus has the time
    policy, navigator   of our flight software, None: as the run had them; another policy brings its own
                      navigator and none of the run's options
    options           of our flight software, as typed: KEY=VALUE
    session           of the time marks, None: as recorded
    wait_s            for the heartbeat, None: as long as the other side is expected to take
    """

    recording: Path
    only: str | None
    bus: str
    flight: str | None
    emulator: str | None
    pace: str | None
    craft: str | None
    vehicle: str | None
    policy: str | None
    navigator: str | None
    options: tuple[str, ...]
    session: int | None
    require: str
    wait_s: float | None
    limit_s: float
    out: Path | None
    force: bool
    report: Path | None
    same: bool
    quiet: bool
