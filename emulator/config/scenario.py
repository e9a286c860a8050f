"""Scenario files: what the bench plays. TOML, checked whole at the door.

The scenario is the truth's side: orbit, attitude, sky, receivers' behaviour, error factors. The flight
software never sees it; its policy stands here only so that one file describes one run.
"""

from __future__ import annotations

from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    GetJsonSchemaHandler,
    WithJsonSchema,
    create_model,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema

from gnss_hil.dbc.common import gpstime, systems, vehicle
from gnss_hil.dbc.common.shipped_files import Files
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.earth.gravity import HIGHEST_DEGREE
from gnss_hil.emulator.error_models.base import Factor
from gnss_hil.emulator.error_models.params_loops import Loops
from gnss_hil.emulator.error_models.registry import of_scope
from gnss_hil.emulator.receivers.emulated.search import RULES
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS

Positive = Annotated[float, Field(gt=0)]
Angle = Annotated[float, Field(ge=-360, le=360)]
Force = Literal["j2", "j3", "j4", "egm2008", "sun", "moon", "drag", "radiation"]


class ScenarioError(ValueError):
    """A scenario that cannot be played; the message is for people, one line a fault."""


class _Switched(Strict):
    """Factors of one scope by name: a table of parameters, or `name = false` for `{enabled = false}`."""

    @model_validator(mode="before")
    @classmethod
    def _switches(cls, value: Any):
        if not isinstance(value, dict):
            return value
        return {k: {"enabled": v} if isinstance(v, bool) else v for k, v in value.items()}

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Each factor is its table or a switch, as `_switches` reads it."""
        made = handler(core)
        table = handler.resolve_ref_schema(made)
        for name, factor in table["properties"].items():
            table["properties"][name] = {"anyOf": [factor, {"type": "boolean"}]}
        return made

    def on(self) -> dict[str, Factor]:
        """The factors that are on, by name, in the registry's order."""
        return {name: row for name, row in self if row.enabled}


def _factors(scope: str) -> type[_Switched]:
    rows = of_scope(scope).items()
    fields = {name: (row.model, row.model(enabled=row.default)) for name, row in rows}
    return create_model(f"{scope.capitalize()}Factors", __base__=_Switched, **fields)


SkyFactors, CraftFactors = _factors("sky"), _factors("craft")


_GPS_TIME = {"type": "string", "pattern": r"^\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?$"}
GpsTime = Annotated[datetime, WithJsonSchema(_GPS_TIME)]
FIRST_START, LAST_START = datetime(1980, 1, 6), datetime(2100, 1, 1)


class Time(Strict):
    """Start on the GPS scale, length and step. Noise is drawn anew in each epoch, white from one to the next,
    which holds for intervals of 1 s and more; shorter ones are for dynamics, not for statistics of noise.

    orientation  file finals2000A of the IERS: UT1 and the pole, by which trajectories and attitudes told in
                 celestial axes come to the Earth's. Without it UT1 is UTC and the pole stands still, which
                 puts such a craft up to 450 m away in low orbit. Computed orbits and the Sun do without it:
                 an `orbit` is counted from the Earth as it stands at UT1 = UTC, and the Sun is 14 arcsec off
    """

    start_gps: GpsTime
    duration_s: Annotated[float, Field(gt=0, le=31 * 86400)] = 600
    epoch_interval_s: Annotated[float, Field(ge=0.01, le=60)] = 1.0
    orientation: str | None = None

    @field_validator("start_gps")
    @classmethod
    def _on_the_gps_scale(cls, value: datetime) -> datetime:
        if value.tzinfo is not None:
            raise ValueError("must be written without an offset: it is GPS time")
        if not FIRST_START <= value < LAST_START:
            raise ValueError(f"must be from {FIRST_START:%Y-%m-%d} until {LAST_START:%Y-%m-%d}")
        return value

    @property
    def start_ns(self) -> int:
        return gpstime.from_calendar(self.start_gps)

    @property
    def interval_ns(self) -> int:
        return round(self.epoch_interval_s * gpstime.NS_PER_S)

    @property
    def epochs(self) -> int:
        return max(1, round(self.duration_s * gpstime.NS_PER_S / self.interval_ns))

    @property
    def span_ns(self) -> tuple[int, int]:
        """GPS time of the first epoch and of the last."""
        return self.start_ns, self.start_ns + (self.epochs - 1) * self.interval_ns


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
    sources = {s.name: (Source, _SKY.get(s.name, "none")) for s in tracked}
    offsets = {
        f"{s.name}_offset_ns": (Offset, _OFFSET_NS.get(s.name, 0.0)) for s in tracked if not s.reference
    }
    return create_model("OfEachSystem", __base__=Strict, **sources, **offsets)


class Sky(_of_each_system()):
    """Each system: "nominal", "none", navigation files, or SP3 files.

    orbits             SP3 files that are flown while satellites report what gps and glonass say; without
                       them what they report is the truth
    reports            "broadcast": satellites are, for receivers, where gps and glonass say; "orbits": where
                       `orbits` do, and gps and glonass tell issue, health and group delay alone
    almanac            files (YUMA, SEM, AGL) that receivers know untracked satellites by; without them they
                       know the sky itself. Weeks of GPS are those nearest to the start of the run
    *_offset_ns        what no message tells: positive lengthens the system's pseudoranges, that is its time
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


class Orbit(Strict):
    """Osculating elements at the start, in its celestial intermediate frame (true equator of date; the node
    is counted from the intermediate origin), and the forces that act.

    forces          j2, j3, j4, or egm2008 to `degree`; sun and moon; drag; radiation (sunlight)
    drag_*          of a ball in air of mean solar activity (Harris-Priester); the air bulges with an exponent
                    of 2 for low inclinations to 6 for polar orbits
    radiation_*     of a ball; the coefficient is 1 where light is absorbed, 2 where it is mirrored

    Without the factor `transmit_pattern` navigation satellites radiate equally in all directions: what is
    seen and measured is right in low orbits; high ones fly, but see too many satellites too well.
    """

    semi_major_axis_km: Annotated[float, Field(ge=6500, le=100_000)] | None = None
    altitude_km: Annotated[float, Field(ge=150, le=90_000)] | None = None
    eccentricity: Annotated[float, Field(ge=0, lt=0.95)] = 0.0
    inclination_deg: Annotated[float, Field(ge=0, le=180)]
    raan_deg: Angle = 0.0
    arg_perigee_deg: Angle = 0.0
    true_anomaly_deg: Angle = 0.0
    forces: tuple[Force, ...] = ("j2", "j3", "j4")
    degree: Annotated[int, Field(ge=2, le=HIGHEST_DEGREE)] = 20
    mass_kg: Positive = 1000.0
    drag_area_m2: Positive = 10.0
    drag_coefficient: Annotated[float, Field(gt=0, le=10)] = 2.2
    bulge_exponent: Annotated[float, Field(ge=2, le=6)] = 4.0
    radiation_area_m2: Positive = 10.0
    radiation_coefficient: Annotated[float, Field(ge=0, le=2)] = 1.3

    @model_validator(mode="after")
    def _one_size(self):
        if (self.semi_major_axis_km is None) == (self.altitude_km is None):
            raise ValueError("orbit needs one of semi_major_axis_km and altitude_km")
        return self

    @model_validator(mode="after")
    def _forces_act_once(self):
        names = list(self.forces)
        twice = {name for name in names if names.count(name) > 1}
        zonals = {"j2", "j3", "j4"} & set(names) if "egm2008" in names else set()
        if twice or zonals:
            why = "contained in egm2008" if zonals else "named twice"
            raise ValueError(f"forces: {', '.join(sorted(twice or zonals))} {why}")
        return self


class Turn(Strict):
    """Attitude relative to the orbital frame at t_s after the start."""

    t_s: Annotated[float, Field(ge=0)]
    roll_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    yaw_deg: Angle = 0.0


class Attitude(Strict):
    """`lvlh` flies x fore, y starboard, z nadir; `offset` is turned from it; `inertial` keeps the start's
    offset attitude in inertial space; `slew` follows a profile of turns; `table` is that of a file: UTC,
    quaternion_c, _x, _y, _z, body from celestial axes (J2000)."""

    mode: Literal["lvlh", "offset", "inertial", "slew", "table"] = "lvlh"
    roll_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    yaw_deg: Angle = 0.0
    profile: tuple[Turn, ...] = ()
    file: str | None = None

    @model_validator(mode="after")
    def _profile_goes_with_slew(self):
        if (self.mode == "slew") != bool(self.profile):
            raise ValueError("profile goes with mode 'slew', and mode 'slew' with a profile")
        if (self.mode == "table") != (self.file is not None):
            raise ValueError("file goes with mode 'table', and mode 'table' with a file")
        times = [turn.t_s for turn in self.profile]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError(f"profile times are {times}; each must be later than the one before")
        if self.mode == "lvlh" and (self.roll_deg or self.pitch_deg or self.yaw_deg):
            raise ValueError("mode 'lvlh' takes no angles; use mode 'offset'")
        return self


class Receivers(Strict):
    """How the emulated receivers behave; times of acquisition by state of knowledge."""

    autonomous: Literal[tuple(RULES)] = "elevation"
    hot_s: Annotated[float, Field(ge=0, le=120)] = 1.0
    warm_s: Annotated[float, Field(ge=0, le=120)] = 3.0
    cold_s: Annotated[float, Field(ge=0, le=600)] = 12.0
    ephemeris_s: Annotated[float, Field(ge=0, le=120)] = 24.0
    ephemeris_age_s: Positive = 7200.0
    almanac_cycle_s: Annotated[float, Field(ge=1, le=600)] = 20.0
    lock_threshold_dbhz: Annotated[float, Field(ge=10, le=50)] = 30.0
    gain_dbi: Annotated[float, Field(ge=-20, le=30)] = 4.0
    gain_at_90deg_dbi: Annotated[float, Field(ge=-60, le=30)] = -6.0
    noise_temperature_k: Annotated[float, Field(gt=0, le=5000)] = 400.0
    loops: Loops = Loops()


class Clock(Strict):
    """Receiver oscillators: a bounded wander, `amplitude_ms * sin`, of random phase in each domain.

    mark_domain  clock domain that the time marks are read from; without it they are GPS time
    """

    amplitude_ms: Annotated[float, Field(ge=0, le=10)] = 0.3
    period_s: Annotated[float, Field(ge=60)] = 5400.0
    mark_domain: Annotated[int, Field(ge=0, le=7)] | None = None


class TrajectoryFile(Strict):
    """A known orbit instead of one that is computed; one of the three.

    oem     CCSDS orbit ephemeris message, keyword or XML
    tle     two-line elements, propagated by SGP4; object: which set's, by name or catalogue number
    csv     table: UTC, position_x, _y, _z in celestial axes (J2000), in `unit`
    """

    oem: str | None = None
    tle: str | None = None
    csv: str | None = None
    object: str | None = None
    unit: Literal["m", "km", "ft"] = "m"

    @model_validator(mode="after")
    def _one_file(self):
        given = [kind for kind in ("oem", "tle", "csv") if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(f"trajectory names {', '.join(given) or 'nothing'}; one of oem, tle, csv")
        return self


class ObservationFile(Strict):
    """Observations of a real receiver, played instead of an emulated one.

    file       RINEX 2 or 3 observations, compact or gzip too
    signals    what is played of each satellite, each signal on a channel of its own
    reference  the craft's known orbit: the truth, if there is one
    """

    file: str
    signals: Annotated[tuple[Literal[tuple(SIGNALS)], ...], Field(min_length=1)] = ("L1CA",)
    reference: TrajectoryFile | None = None


class Flight(Strict):
    """Handed to the flight software on its command line."""

    policy: str = "patent"
    options: dict[str, float | str | bool] = Field(default_factory=dict)


class Craft(Strict):
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
    min: float | None = None
    max: float | None = None


class Scenario(Strict):
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,31}$")]
    description: str = ""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    time: Time
    sky: Sky = Sky()
    craft: Annotated[list[Craft], Field(min_length=1, max_length=4)]
    expect: dict[str, Expectation] = Field(default_factory=dict)

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
    path = Path(name)
    if path.suffix == ".toml" or "/" in name:
        return path
    known = shipped()
    if name not in known:
        raise ScenarioError(
            f"scenario '{name}': not found; shipped are {', '.join(known)} (or give a .toml file)"
        )
    return known[name]


def vehicle_path(craft: Craft, scenario_path: Path) -> Path:
    """A craft's vehicle file: beside the scenario, or shipped."""
    return vehicle.find(craft.vehicle, scenario_path.parent)


def parse(document: dict, origin: str) -> Scenario:
    """A scenario from a TOML document; ScenarioError lists every fault."""
    return FILES.checked(document, origin)


def read(path: Path) -> dict:
    """The TOML document of a file; ScenarioError if it is none."""
    return FILES.read(path)
