"""What is to be replayed: a run folder, or a recording alone; and the craft that it is from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gnss_hil.dbc.common import vehicle as vehicles
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.formats.recording import Recording
from gnss_hil.tools.recording.run_folder import LOG, SCENARIO, vehicle_name
from gnss_hil.tools.replay.recorded_run import RecordedRun, open_run
from gnss_hil.tools.results import assemble
from gnss_hil.tools.results.run_digest import bus_names


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """folder   of the run; None for a recording alone, as is `scenario`
    craft    its name
    number   its place in the scenario
    vehicle  vehicle file, None if none was named
    """

    recorded: RecordedRun
    folder: Path | None
    scenario: Scenario | None
    craft: str
    number: int
    vehicle: Path | None

    @property
    def alone(self) -> bool:
        """Whether the run has no other craft."""
        return self.scenario is not None and len(self.scenario.craft) == 1


def scenario_of(source: Source) -> tuple[Path, Scenario]:
    """Run folder and scenario of a source; Mistake for a recording alone."""
    if source.folder is None or source.scenario is None:
        raise Mistake(f"{source.recorded.recording.path}: is in no run folder; its scenario is needed")
    return source.folder, source.scenario


def find(path: Path, craft: str | None, vehicle: str | None) -> Source:
    """The source of a command line; Mistake names what does not fit.

    craft    its name in the run, or the name of its bus in the recording; None: the only one
    vehicle  file, or name of a shipped one, instead of the run's
    """
    if not path.exists():
        raise Mistake(f"{path}: no such run folder or recording")
    named = Path(vehicles.find(vehicle)) if vehicle else None
    contract = codec(vehicles.load(named).antennas) if named else None
    folder = _folder_of(path)
    if folder is None:
        recorded = open_run(Recording(path), craft, contract)
        return Source(recorded, None, None, recorded.bus, 0, named)
    recording = Recording(folder / LOG if path == folder else path)
    scenario, _ = assemble.read_scenario(folder)
    names = [c.name for c in scenario.craft]
    buses = bus_names(names)
    if craft is None and len(names) > 1:
        raise Mistake(f"{path}: has {len(names)} craft; choose one with --craft: {', '.join(names)}")
    wanted = craft or names[0]
    if wanted not in (*names, *buses):
        raise Mistake(f"--craft {wanted}: no such craft in {path}; it has {', '.join(names)}")
    number = names.index(wanted) if wanted in names else buses.index(wanted)
    recorded = open_run(recording, buses[number], contract)
    file = named or folder / vehicle_name(names, number)
    return Source(recorded, folder, scenario, names[number], number, file)


def _folder_of(path: Path) -> Path | None:
    """The run folder that is named, or that a named bus.log lies in."""
    if path.is_dir():
        for name in (SCENARIO, LOG):
            if not (path / name).is_file():
                raise Mistake(f"{path}: is no run folder with a log: it has no {name}")
        return path
    return path.parent if path.name == LOG and (path.parent / SCENARIO).is_file() else None
