"""Tables of a scenario file that stand by themselves: time, orbit, attitude, clock, trajectory files."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, WithJsonSchema, field_validator, model_validator

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.earth.gravity import HIGHEST_DEGREE

Kilograms = Annotated[float, Field(ge=0.01, le=1e6)]
SquareMetres = Annotated[float, Field(ge=1e-4, le=1e5)]
"""From a chip-sized craft to a station twice the largest flown."""
LONGEST_S = 31 * 86400
"""A run at most [s]."""
Angle = Annotated[float, Field(ge=-360, le=360)]
Force = Literal["j2", "j3", "j4", "egm2008", "sun", "moon", "drag", "radiation"]


class ScenarioError(ValueError):
    """A scenario that cannot be played; the message is for people, one line a fault."""


Tell = Callable[[str], None]
"""Takes a remark: one line on something odd in a scenario's files that the run goes on with."""


def untold(remark: str) -> None:
    """Where nobody listens."""


_GPS_TIME = {"type": "string", "pattern": r"^\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?$"}
GpsTime = Annotated[datetime, WithJsonSchema(_GPS_TIME)]
FIRST_START, LAST_START = datetime(1980, 1, 6), datetime(2100, 1, 1)


class Time(Strict):
    """Start on the GPS scale, length and step. Noise is drawn anew in each epoch, white from one to the next,
    which holds for intervals of 1 s and more; shorter ones are for dynamics, not for statistics of noise.

    start_gps         of the first epoch, on the GPS scale, without an offset
    duration_s        of the run; `--duration` of the command line counts more
    epoch_interval_s  from one epoch to the next; `--interval` counts more
    orientation       file finals2000A of the IERS: UT1 and the pole, by which trajectories and attitudes in
                      celestial axes come to the Earth's. Without it UT1 is UTC and the pole stands still,
                      which puts such a craft up to 450 m away in low orbit. Computed orbits and the Sun do
                      without it: an `orbit` is counted from the Earth as it stands at UT1 = UTC, and the Sun
                      is 14 arcsec off
    """

    start_gps: GpsTime
    duration_s: Annotated[float, Field(gt=0, le=LONGEST_S)] = 600
    epoch_interval_s: Annotated[float, Field(ge=0.01, le=60)] = 1.0
    orientation: str | None = None

    @field_validator("start_gps", mode="before")
    @classmethod
    def _is_a_date(cls, value: object) -> object:
        if not isinstance(value, str | datetime):  # a number would count as seconds of Unix time
            raise ValueError("must be a date and time, as in 2012-10-31T00:15:00")
        return value

    @field_validator("start_gps")
    @classmethod
    def _on_the_gps_scale(cls, value: datetime) -> datetime:
        if value.tzinfo is not None:
            raise ValueError("must be written without an offset: it is GPS time")
        if not FIRST_START <= value < LAST_START:
            raise ValueError(f"must be from {FIRST_START:%Y-%m-%d} until {LAST_START:%Y-%m-%d}")
        return value

    @model_validator(mode="after")
    def _holds_an_epoch(self):
        if self.duration_s < self.epoch_interval_s:
            lengths = f"duration_s is {self.duration_s:g}, epoch_interval_s {self.epoch_interval_s:g}"
            raise ValueError(f"{lengths}: a run has at least one epoch")
        return self

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
    def played_s(self) -> float:
        """Length of all epochs: `duration_s`, to the nearest whole number of them."""
        return self.epochs * self.interval_ns / gpstime.NS_PER_S

    @property
    def span_ns(self) -> tuple[int, int]:
        """GPS time of the first epoch and of the last."""
        return self.start_ns, self.start_ns + (self.epochs - 1) * self.interval_ns


class Orbit(Strict):
    """Osculating elements at the start, in its celestial intermediate frame (true equator of date; the node
    is counted from the intermediate origin), and the forces that act.

    semi_major_axis_km, altitude_km   one of the two; the axis is altitude plus equatorial radius
    eccentricity    0: a circle
    inclination_deg   of the plane to the equator
    raan_deg        right ascension of the ascending node
    arg_perigee_deg   argument of the perigee
    true_anomaly_deg  from the perigee, at the start
    degree          of egm2008, and its order
    mass_kg         of the craft, for drag and sunlight
    bulge_exponent  how the air bulges: 2 for low inclinations to 6 for polar orbits
    forces          j2, j3, j4, or egm2008 to `degree`; sun and moon; drag; radiation (sunlight)
    drag_*          of a ball in air of mean solar activity (Harris-Priester)
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
    mass_kg: Kilograms = 1000.0
    drag_area_m2: SquareMetres = 10.0
    drag_coefficient: Annotated[float, Field(ge=0.01, le=10)] = 2.2
    bulge_exponent: Annotated[float, Field(ge=2, le=6)] = 4.0
    radiation_area_m2: SquareMetres = 10.0
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
    """Attitude relative to the orbital frame at an instant; held before the first and after the last,
    turned smoothly (quintics) from one to the next.

    t_s       after the start, each later than the one before
    roll_deg, pitch_deg, yaw_deg   about x fore, y starboard, z nadir; yaw first, roll last
    """

    t_s: Annotated[float, Field(ge=0, le=LONGEST_S)]
    roll_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    yaw_deg: Angle = 0.0


class Attitude(Strict):
    """How the craft is turned; axes x fore, y starboard, z nadir in orbital attitude.

    mode      "lvlh": orbital attitude; "offset": turned from it by the angles; "inertial": the offset
              attitude of the start, kept in inertial space; "slew": by `profile`; "table": by `file`
    roll_deg, pitch_deg, yaw_deg   from the orbital attitude; yaw first, roll last
    file      table: UTC, quaternion_c, _x, _y, _z between body axes and those of J2000, scalar first
    convention   of the table's quaternions q, which goes with a file and has no default, since both are in
              use: "body_from_celestial": v_body = q* v_celestial q, as on the bus (q turns the axes of J2000
              into those of the body); "celestial_from_body": v_celestial = q* v_body q, the conjugate
              (SPICE's quaternion of a C-matrix, v_body = q v_celestial q*)
    """

    mode: Literal["lvlh", "offset", "inertial", "slew", "table"] = "lvlh"
    roll_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    yaw_deg: Angle = 0.0
    profile: tuple[Turn, ...] = ()
    file: str | None = None
    convention: Literal["body_from_celestial", "celestial_from_body"] | None = None

    @model_validator(mode="after")
    def _profile_goes_with_slew(self):
        if (self.mode == "slew") != bool(self.profile):
            raise ValueError("profile goes with mode 'slew', and mode 'slew' with a profile")
        if (self.mode == "table") != (self.file is not None):
            raise ValueError("file goes with mode 'table', and mode 'table' with a file")
        if (self.mode == "table") != (self.convention is not None):
            both = "convention = 'body_from_celestial' or 'celestial_from_body', of the file's quaternions"
            raise ValueError(f"mode 'table' takes {both}, and no other mode does")
        times = [turn.t_s for turn in self.profile]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError(f"profile times are {times}; each must be later than the one before")
        if self.mode == "lvlh" and (self.roll_deg or self.pitch_deg or self.yaw_deg):
            raise ValueError("mode 'lvlh' takes no angles; use mode 'offset'")
        return self


class Clock(Strict):
    """Receiver oscillators: a bounded wander, `amplitude_ms * sin`, of random phase in each domain.

    amplitude_ms   of the wander; 0: clocks without error
    period_s       of the wander
    mark_domain  clock domain that the time marks are read from; without it they are GPS time
    """

    amplitude_ms: Annotated[float, Field(ge=0, le=10)] = 0.3
    period_s: Annotated[float, Field(ge=60, le=LONGEST_S)] = 5400.0
    mark_domain: Annotated[int, Field(ge=0, le=7)] | None = None


class TrajectoryFile(Strict):
    """A given orbit instead of one that is computed; one of the three.

    oem     CCSDS orbit ephemeris message, keyword or XML; about the Earth's centre; segments are kept apart
    tle     two-line elements, propagated by SGP4; of a history the set nearest to the run
    csv     table: UTC (an offset such as +03:00 counts), position_x, _y, _z in celestial axes (J2000), in
            `unit`
    object  whose elements of a file with several objects, by name or catalogue number
    unit    of the table
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
