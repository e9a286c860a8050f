"""Scenario files: what the bench plays. TOML, checked whole at the door.

The scenario is the truth's side: orbit, attitude, sky, receivers' behaviour, error factors. The flight
software never sees it; its policy stands here only so that one file describes one run.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    GetJsonSchemaHandler,
    create_model,
    model_validator,
)
from pydantic_core import CoreSchema

from gnss_hil.dbc.common import systems, vehicle
from gnss_hil.dbc.common.near import hint
from gnss_hil.dbc.common.shipped_files import Files
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.config.tables import (
    LONGEST_S,
    Attitude,
    Clock,
    Orbit,
    ScenarioError,
    Time,
    TrajectoryFile,
)
from gnss_hil.emulator.error_models.base import Row as ErrorModelRow
from gnss_hil.emulator.error_models.registry import of_scope
from gnss_hil.emulator.faults.files import AnyFault
from gnss_hil.emulator.receivers.emulated.search import RULES
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS
from gnss_hil.emulator.sensors.base import Row as SensorRow
from gnss_hil.emulator.sensors.registry import SENSORS
from gnss_hil.emulator.signal.loops import Loops


class _Switched(Strict):
    """Factors of one scope, or sensors, by name: a table of parameters, or `name = false` for
    `{enabled = false}`."""

    @model_validator(mode="before")
    @classmethod
    def _switches(cls, value: Any):
        if not isinstance(value, dict):
            return value
        return {k: {"enabled": v} if isinstance(v, bool) else v for k, v in value.items()}

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Each is its table or a switch, as `_switches` reads it."""
        made = handler(core)
        table = handler.resolve_ref_schema(made)
        for name, one in table["properties"].items():
            table["properties"][name] = {"anyOf": [one, {"type": "boolean"}]}
        return made

    def on(self) -> dict[str, Any]:
        """Parameters of what is on, by name, in the registry's order."""
        return {name: row for name, row in self if row.enabled}


def _switched(name: str, rows: Mapping[str, ErrorModelRow | SensorRow]) -> type[_Switched]:
    fields: dict[str, Any] = {key: (row.params, row.params(enabled=row.default)) for key, row in rows.items()}
    return create_model(name, __base__=_Switched, **fields)


class SkyFactors(_switched("SkyFactors", of_scope("sky"))):
    """Errors of satellites and of what lies between them and every craft."""


class CraftFactors(_switched("CraftFactors", of_scope("craft"))):
    """Errors of one craft."""


class Sensors(_switched("Sensors", SENSORS)):
    """Sensor nodes of one craft beside its receivers.

    attitude   the attitude unit, without which the flight software cannot turn lever arms
    """


Source = str | list[str]
Offset = Annotated[float, Field(ge=-1000, le=1000)]

_SKY: dict[str, Source] = {"gps": "nominal", "glonass": "nominal"}
"""Sources of systems that a scenario does not name; "none" for others."""

_OFFSET_NS = {"glonass": 30.0}
"""Offsets from the reference system that a scenario does not name; zero for others."""


def _of_each_system() -> type[Strict]:
    """Keys of [sky] for every system that receivers track: its source, and its offset unless it is the
    reference."""
    tracked = systems.tracked()
    sources: dict[str, Any] = {s.name: (Source, _SKY.get(s.name, "none")) for s in tracked}
    offsets: dict[str, Any] = {
        f"{s.name}_offset_ns": (Offset, _OFFSET_NS.get(s.name, 0.0)) for s in tracked if not s.reference
    }
    return create_model("OfEachSystem", __base__=Strict, **sources, **offsets)


class Sky(_of_each_system()):
    """Where satellites are, and what they report.

    gps, glonass       "nominal": slots of the constellation; "none"; or files, navigation messages or SP3
    orbits             SP3 files that are flown while satellites report what gps and glonass give; without
                       them what they report is the truth
    reports            "broadcast": satellites are, for receivers, where gps and glonass put them; "orbits":
                       where `orbits` do, and gps and glonass give issue, health and group delay alone
    almanac            files (YUMA, SEM, AGL) that receivers know untracked satellites by; without them they
                       know the sky itself. Weeks of GPS are those nearest to the start of the run
    *_offset_ns        in no message: positive lengthens the system's pseudoranges, that is its time
                       behind GPS (a signal sent at GPS time t is stamped earlier than t)
    ray_height_km      a ray that passes the Earth lower than this counts as hidden
    """

    orbits: tuple[str, ...] = ()
    reports: Literal["broadcast", "orbits"] = "broadcast"
    almanac: tuple[str, ...] = ()
    ray_height_km: Annotated[float, Field(ge=0, le=2000)] = 50.0
    factors: SkyFactors = SkyFactors()

    def sources(self) -> dict[str, Source]:
        """Source of each system's satellites, by its name."""
        return {system.name: getattr(self, system.name) for system in systems.tracked()}

    def offset_ns(self, system: str) -> float:
        """What the system's pseudoranges are longer than the reference's [ns]."""
        return getattr(self, f"{system}_offset_ns", 0.0)

    @model_validator(mode="after")
    def _orbits_to_report(self):
        if self.reports == "orbits" and not self.orbits:
            raise ValueError('reports is "orbits", and orbits names no file')
        return self


class Receivers(Strict):
    """How the emulated receivers behave.

    autonomous      how a receiver chooses satellites while no command has been given: highest elevation,
                    nearest to its boresight, lowest number (prn), least dilution (gdop)
    hot_s           to find a signal knowing time, almanac and ephemeris
    warm_s          the same without the ephemeris
    cold_s          the same knowing nothing
    ephemeris_s     to collect an ephemeris once the signal is held (see `data_collection`)
    ephemeris_age_s   how long a collected ephemeris serves
    almanac_cycle_s   in which every satellite's prediction is sent once
    lock_threshold_dbhz   weaker signals are not found, and lost
    gain_dbi        of the antennas along the boresight, without `receive_pattern`
    gain_at_90deg_dbi   the same at right angles; linear in the cosine between
    noise_temperature_k   of antenna and receiver together, without `link_budget`
    other_signals_gain_db     of the antennas for the vehicle's `other_signals`, relative to the first ones
    other_signals_centre_mm   phase centre for these, beyond the first ones' along the boresight
    """

    autonomous: Literal[tuple(RULES)] = "elevation"  # pyright: ignore[reportInvalidTypeForm]
    hot_s: Annotated[float, Field(ge=0, le=120)] = 1.0
    warm_s: Annotated[float, Field(ge=0, le=120)] = 3.0
    cold_s: Annotated[float, Field(ge=0, le=600)] = 12.0
    ephemeris_s: Annotated[float, Field(ge=0, le=120)] = 24.0
    ephemeris_age_s: Annotated[float, Field(ge=1, le=LONGEST_S)] = 7200.0
    almanac_cycle_s: Annotated[float, Field(ge=1, le=600)] = 20.0
    lock_threshold_dbhz: Annotated[float, Field(ge=10, le=50)] = 30.0
    gain_dbi: Annotated[float, Field(ge=-20, le=30)] = 4.0
    gain_at_90deg_dbi: Annotated[float, Field(ge=-60, le=30)] = -6.0
    noise_temperature_k: Annotated[float, Field(ge=1, le=5000)] = 400.0
    other_signals_gain_db: Annotated[float, Field(ge=-40, le=40)] = 0.0
    other_signals_centre_mm: Annotated[float, Field(ge=-1000, le=1000)] = 0.0
    loops: Loops = Loops()


class ObservationFile(Strict):
    """Observations of a real receiver, played instead of an emulated one.

    file       RINEX 2, 3 or 4 observations, compact or gzip too
    signals    what is played of each satellite, each signal on a channel of its own
    reference  the craft's reference orbit: the truth, if there is one
    """

    file: str
    signals: Annotated[
        tuple[Literal[tuple(SIGNALS)], ...],  # pyright: ignore[reportInvalidTypeForm]
        Field(min_length=1),
    ] = ("L1CA",)
    reference: TrajectoryFile | None = None


class Flight(Strict):
    """Handed to the flight software on its command line.

    policy   which antenna tracks which satellite, see docs/patent.md; `--policy` counts more
    navigator  how measurements become a fix; by default the policy's; `--navigator` counts more
    options  of the policy, of the navigator or of any flight, by name; `--option NAME=VALUE` counts more
    """

    policy: str = "patent"
    navigator: str | None = None
    options: dict[str, bool | int | float | str] = Field(default_factory=dict)


class Craft(Strict):
    """One spacecraft, on a bus of its own; its motion is one of orbit, trajectory and observations.

    name       of the craft in tables, files and expectations
    vehicle    its vehicle file: beside the scenario, or one that ships
    structure  its structure file, likewise, for `shadowing` and `multipath`
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,15}$")]
    vehicle: str
    orbit: Orbit | None = None
    trajectory: TrajectoryFile | None = None
    observations: ObservationFile | None = None
    attitude: Attitude = Attitude()
    structure: str | None = None
    receivers: Receivers = Receivers()
    clock: Clock = Clock()
    flight: Flight = Flight()
    factors: CraftFactors = CraftFactors()
    sensors: Sensors = Sensors()

    @model_validator(mode="after")
    def _one_motion(self):
        motions = ("orbit", "trajectory", "observations")
        given = [name for name in motions if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"a craft has one of {', '.join(motions)}; this one has {' and '.join(given) or 'none'}"
            )
        return self


class Expectation(Strict):
    """Limits of a figure of summary.json, NAME its path without `craft`, in quotes:
    `"soyuz.position_error_m.p95" = {max = 3}`, or of the run: `"frames.lost" = {max = 0}`. A figure outside
    fails the run. Figures under `soyuz.converged` are of the epochs from 60 s after the first fix on.

    min   the figure is at least this
    max   the figure is at most this
    after_s   of figures made of single epochs: only those from so long after the run's first on
    """

    min: Annotated[float, Field(ge=-1e15, le=1e15)] | None = None
    max: Annotated[float, Field(ge=-1e15, le=1e15)] | None = None
    after_s: Annotated[float, Field(ge=0, le=LONGEST_S)] | None = None

    @model_validator(mode="after")
    def _limits_something(self):
        if self.min is None and self.max is None:
            raise ValueError("expects nothing; give min, max or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min {self.min:g} is above max {self.max:g}; nothing would meet it")
        return self


class Scenario(Strict):
    """A run from its first epoch to its verdict.

    name         of the scenario; run folders are called after it
    description  what is to be seen, for `gnss-hil scenarios`
    seed         of all random draws; `--seed` counts more
    fault        tables [[fault]], or lines as `--fault` has them (docs/faults.md)
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,31}$")]
    description: str = ""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    time: Time
    sky: Sky = Sky()
    craft: Annotated[list[Craft], Field(min_length=1, max_length=4)]
    expect: dict[str, Expectation] = Field(default_factory=dict)
    fault: tuple[AnyFault, ...] = ()

    @model_validator(mode="after")
    def _craft_differ(self):
        names = [c.name for c in self.craft]
        if len(set(names)) != len(names):
            raise ValueError(f"craft names are {names}; each must be different")
        return self


FILES = Files("scenario", "gnss_hil.emulator.data", "scenarios", Scenario, ScenarioError)
shipped = FILES.shipped


def find(name: str) -> Path:
    """The file of a scenario given by path or shipped name."""
    path, known = Path(name), shipped()
    if name in known:
        return known[name]
    if name and path.is_dir():
        own = path / "scenario.toml"
        raise ScenarioError(f"{name}: is a folder{f'; its scenario is {own}' if own.is_file() else ''}")
    if path.suffix == ".toml" or "/" in name:
        if _is_missing(path) and (meant := hint(path.stem, known)):
            raise ScenarioError(f"{name}: No such file or directory{meant}")
        return path
    found = "is no .toml file" if name and path.exists() else "not found"
    shipped_ones = f"shipped are {', '.join(known)} (or give a .toml file)"
    raise ScenarioError(f"scenario '{name}': {found}; {shipped_ones}{hint(name, known)}")


def _is_missing(path: Path) -> bool:
    """Whether there is no such file; one that cannot be looked at has its line when it is read."""
    try:
        path.stat()
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return False


def vehicle_path(craft: Craft, scenario_path: Path) -> Path:
    """A craft's vehicle file: beside the scenario, or shipped."""
    return vehicle.find(craft.vehicle, scenario_path.parent)


def parse(document: dict, origin: str) -> Scenario:
    """A scenario from a TOML document; ScenarioError lists every fault."""
    return FILES.checked(document, origin)


def read(path: Path) -> dict:
    """The TOML document of a file; ScenarioError if it is none."""
    return FILES.read(path)
