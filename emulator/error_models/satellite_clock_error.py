"""What the clocks that satellites broadcast are off: new at each upload, then the clock's own wandering.

At an upload the offset is known but for `upload_m`, the frequency but for what a day's observation leaves,
which is the clock's Allan deviation over a day. From then on the clock runs freely: white noise of frequency,
as the physics of atomic standards makes it. Exact at whole minutes; within one a clock runs straight.

Source: Allan, "Time and frequency characterization, estimation and prediction of precision clocks and
oscillators", IEEE Trans. UFFC 34 (1987) 647, tables of prediction errors (optimum for white frequency noise)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.constellation.uploads import MINUTE_NS, Uploads, by_number, uploads
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models import broadcast
from gnss_hil.emulator.error_models.base import ReportInput, ReportTerm
from gnss_hil.emulator.error_models.broadcast import Period, Sigma
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import SKY_KEY, Stream


class SatelliteClockError(Factor):
    """Clocks as broadcast: what they have done since the last upload, and what the upload was off.

    gps_clock, glonass_clock            kind of clock: "rb", "cs", "maser"
    gps_upload_m, glonass_upload_m      1 sigma of the offset at the upload [m] (modelled, see EphemerisError)
    gps_upload_s, glonass_upload_s      how long an upload serves [s], whole minutes
    """

    gps_clock: Literal["rb", "cs", "maser"] = "rb"
    glonass_clock: Literal["rb", "cs", "maser"] = "cs"
    gps_upload_m: Sigma = 0.6
    glonass_upload_m: Sigma = 1.0
    gps_upload_s: Period = 86400.0
    glonass_upload_s: Period = 43200.0


_DAY_S = 86_400.0
_MINUTE_S = 60.0
_PER_HOUR = 60


@dataclass(frozen=True, slots=True)
class Clock:
    """day  Allan deviation over a day, all of it white noise of frequency."""

    name: str
    day: float
    source: str


CLOCKS = table(
    Clock(
        "rb", 1e-14, "GPS IIF rubidium, 1e-14 over a day: typical of published on-orbit stabilities, modelled"
    ),
    Clock(
        "cs", 1e-13, "GLONASS-M caesium: 1e-13 over a day. GLONASS ICD 5.1 (2008), 3.3.3, typed from memory"
    ),
    Clock("maser", 3.4e-15, "passive hydrogen maser, 1e-12 at 1 s: modelled"),
)


def errors(parameters: SatelliteClockError, seed: int, index: I64, middles_ns: I64, nodes_s: F64) -> F64:
    """Reported minus true clocks (s, k, n) [m] of satellites index (n,).

    middles_ns (s,)  middles of minutes of GPS time [ns];  nodes_s (k,) relative to them [s]
    Satellites of systems without parameters report the truth.
    """
    day, upload_m, plan = _by_satellite(parameters, seed, index)
    minute = middles_ns // MINUTE_NS
    number = plan.number(minute)
    begun = plan.begun(number)
    drawn = by_number(Stream(seed, SKY_KEY, "satellite_clock_error"), number, index, 2)
    off_m, frequency = upload_m * drawn[..., 0], day * drawn[..., 1]
    ends = np.stack((minute, minute + 1))[..., None]
    walked_s = _walked(seed, index, begun, ends) * (day * np.sqrt(_DAY_S))
    at_m = off_m + LIGHT_MPS * (walked_s + frequency * _MINUTE_S * (ends - begun))
    part = (nodes_s / _MINUTE_S + 0.5)[:, None]
    return at_m[0][:, None] + part * (at_m[1] - at_m[0])[:, None]


def _by_satellite(parameters: SatelliteClockError, seed: int, index: I64) -> tuple[F64, F64, Uploads]:
    """Allan deviation over a day (n,), 1 sigma at an upload (n,) [m], uploads."""
    system = satellites.system_of(index)
    day, upload_m = np.zeros(len(index)), np.zeros(len(index))
    for value, clock in broadcast.by_system(parameters, "clock").items():
        day[system == value] = CLOCKS[clock].day
    for value, sigma_m in broadcast.by_system(parameters, "upload_m").items():
        upload_m[system == value] = sigma_m
    return day, upload_m, uploads(seed, index, broadcast.by_system(parameters, "upload_s"))


def _walked(seed: int, index: I64, begun: I64, ends: I64) -> F64:
    """Standard Brownian motion [s^0.5] of satellites from the minutes begun (s, n) to ends (..., s, 1)."""
    # Who is never given an upload has not begun within this age, and has no clock error either.
    first = int(np.min(np.where(begun > 0, begun, np.min(ends))))
    sums = _sums(seed, index, first, int(np.max(ends)))
    column = np.arange(len(index))
    return sums[ends - first, column] - sums[np.maximum(begun - first, 0), column]


def _sums(seed: int, index: I64, first: int, last: int) -> F64:
    """Brownian motion (last - first + 1, n) [s^0.5] at whole minutes, zero at the first."""
    hours = range(first // _PER_HOUR, (last - 1) // _PER_HOUR + 1)
    stream = Stream(seed, SKY_KEY, "satellite_clock_error minutes")
    raw = np.stack([stream.words(hour, satellites.SATELLITES * _PER_HOUR) for hour in hours])
    minutes = raw.reshape(len(hours), satellites.SATELLITES, _PER_HOUR)[:, index]
    steps = keyed_draws.normal(minutes).transpose(0, 2, 1).reshape(-1, len(index))
    start = first - hours[0] * _PER_HOUR
    steps = steps[start : start + last - first] * np.sqrt(_MINUTE_S)
    return np.concatenate((np.zeros((1, len(index))), np.cumsum(steps, axis=0)))


def _reported(params: SatelliteClockError, seed: int, index: I64, at: ReportInput) -> ReportTerm:
    return ReportTerm(off_clock_m=errors(params, seed, index, at.middles_ns, at.nodes_s))


ROW = broadcast.row(
    "satellite_clock_error",
    SatelliteClockError,
    _reported,
    "the same; Allan deviations by kind of clock",
    shows="SV_CLOCK",
)
