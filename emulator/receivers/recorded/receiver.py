"""A craft whose receiver is real: its observations come from a file, its frames are those of any craft.

Its marks are the file's epoch tags, by the receiver's own clock: so they are reported on the bus. Satellites
are put where they were when they sent, which a pseudorange and a tag of the same clock determine exactly,
however far that clock is off. Where there is a reference orbit it is the truth; else there is none. The
attitude is unknown: body axes are reported as those of the Earth, which means nothing while the vehicle file
has no lever arms. The receiver obeys no command.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I8, I64, Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.emulator.constellation.almanac.orbits import HeldAlmanac
from gnss_hil.emulator.constellation.base import PRECISE, WITHOUT_GROUP_DELAY, Broadcast
from gnss_hil.emulator.constellation.sky import Sky, SkyState
from gnss_hil.emulator.earth.constants import LIGHT_MPS, ROTATION_RPS
from gnss_hil.emulator.environment.signals import reported_at_transmission
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.emulated import almanac
from gnss_hil.emulator.receivers.observations import Observations
from gnss_hil.emulator.receivers.recorded.tracks import Tracks
from gnss_hil.emulator.sensors import attitude
from gnss_hil.emulator.sensors.base import Reading
from gnss_hil.emulator.sensors.frames import node
from gnss_hil.emulator.signal.group_delays import beyond_first_m
from gnss_hil.emulator.truth import TRUTH, in_view_bits

AS_ECEF = np.array((1.0, 0.0, 0.0, 0.0))
"""The stated attitude: body axes along those of ECEF, turning with the Earth."""

EARTH_RATE_RPS = np.array((0.0, 0.0, ROTATION_RPS))

MARK_OF_DOMAIN_0 = 1
"""Value of the contract's table "MarkClock": the mark is what the clock of domain 0 showed."""

MISSING_CN0_DBHZ = 45.0
"""C/N0 of signals whose strength is not in the file (modelled)."""


class Trajectory(Protocol):
    """Where a craft has been, by reference."""

    def at(self, t_ns: int) -> CraftState: ...

    def holds(self, t_ns: int) -> bool: ...


@dataclass(frozen=True, slots=True, eq=False)
class RecordedCraft:
    """What does not change of a craft that is played.

    tracks   rows of all epochs;  bounds (epochs + 1,) where each epoch's begin
    marks_ns (epochs,) tags, those that the file would have where it has none
    orbit    the reference, None without one
    frequency   (SATELLITES,) GLONASS frequency numbers by the file, 0 elsewhere
    inter_signal_m   (16, SATELLITES) by how much clocks of signals are more than those of the first, by
             civil messages; nan where these say nothing
    sky, row_of, almanac   satellites, their rows by satellite index, and the almanac instead of the sky
    """

    name: str
    vehicle: Vehicle
    orbit: Trajectory | None
    frequency: I64
    inter_signal_m: F64
    tracks: Tracks
    bounds: I64
    marks_ns: I64
    epochs_per_pass: int
    codec: Codec
    templates: frames.FrameTemplates
    sky: Sky
    almanac: HeldAlmanac | None
    row_of: I64
    session: int
    of_one_carrier: Bool

    @property
    def obeys(self) -> bool:
        return False

    def fresh(self) -> RecordedUnit:
        return RecordedUnit(e2e.fresh_counters(self.codec), np.zeros(len(screening.Verdict), np.int64))

    def prepare(self, unit: RecordedUnit, epoch: int) -> None:
        """Nothing: all of a file is read before the run."""

    def step(
        self, unit: RecordedUnit, received: FrameBatch, epoch: int
    ) -> tuple[RecordedUnit, FrameBatch, NDArray]:
        """One epoch. The receiver is real, and obeys no command."""
        unit, block = play(self, unit, self.sky.at(int(self.marks_ns[epoch])), epoch)
        return unit, block, truth(self, epoch)


@dataclass(frozen=True, slots=True, eq=False)
class RecordedUnit:
    """A played craft between epochs: counters of its streams; commands it has refused, none ever."""

    sent: I8
    refused: I64


def observed(craft: RecordedCraft, sky: SkyState, row_of: I64, epoch: int) -> Observations:
    """What the receiver saw in an epoch, as far as the satellites are in the sky; sky at the epoch's mark."""
    seen = craft.tracks[craft.bounds[epoch] : craft.bounds[epoch + 1]]
    row = row_of[seen.sat]
    known = (row >= 0) & sky.broadcast.available[row]
    seen, row = seen[known], row[known]
    delays_m = sky.broadcast.group_delay_m[row], sky.broadcast.band_delay_m[row]
    told_m = craft.inter_signal_m[seen.signal, seen.sat]
    beyond_m = np.where(np.isfinite(told_m), told_m, beyond_first_m(seen.signal, *delays_m))
    clock_m = sky.clock_m[row] + beyond_m
    # The satellite's clock showed tag - P / c when it sent, and is clock_m ahead of GPS time.
    back_s = (seen.range_m + clock_m) / LIGHT_MPS
    pos, vel = reported_at_transmission(sky, row, back_s)
    drift_mps = sky.clock_drift_mps[row]
    return Observations(
        receiver=np.zeros(len(row), np.int64),
        channel=seen.channel,
        row=row,
        sat=seen.sat,
        signal=seen.signal,
        pseudorange_m=seen.range_m,
        range_rate_mps=seen.rate_mps,
        phase_cyc=np.nan_to_num(seen.phase_cyc),
        cn0_dbhz=np.where(np.isfinite(seen.cn0_dbhz), seen.cn0_dbhz, MISSING_CN0_DBHZ),
        slips=seen.slips,
        half_cycle=seen.half_cycle,
        pos_ecef_m=pos,
        vel_ecef_mps=vel,
        clock_m=clock_m - drift_mps * back_s,
        clock_drift_mps=drift_mps,
    )


@cache
def _attitude(codec: Codec) -> frames.Part:
    """Frames of the attitude unit, the same in every epoch."""
    reading = Reading(np.zeros(1, np.int64), attitude.values(AS_ECEF, EARTH_RATE_RPS))
    sent = node(codec, attitude.ROW, attitude.Sensor(), "recorded").frames(reading, 1)[0]
    return frames.Part(sent.can_id, sent.words.view(np.uint8).reshape(-1, WIDTH))


def play(
    craft: RecordedCraft, unit: RecordedUnit, sky: SkyState, epoch: int
) -> tuple[RecordedUnit, FrameBatch]:
    """The block of an epoch; sky at the epoch's mark."""
    held = craft.almanac
    templates, mark_ns = craft.templates, int(craft.marks_ns[epoch])
    sky = replace(sky, broadcast=_as_played(craft, sky))
    seen = observed(craft, sky, craft.row_of, epoch)
    known = almanac.contents(held, sky)
    rows, sender = almanac.portion(known, epoch, craft.epochs_per_pass, craft.vehicle.antennas)
    predicted = almanac.predictions(held, sky, rows, rows, mark_ns)
    leap_s = gpstime.leap_seconds(mark_ns)
    mark = frames.mark_part(templates, craft.session, epoch, mark_ns, leap_s, MARK_OF_DOMAIN_0)
    state = np.full(craft.vehicle.antennas, frames.RECEIVER_STATE["AUTONOMOUS"])
    clocks_s = np.zeros(craft.vehicle.antennas)
    parts = (
        mark,
        _attitude(craft.codec),
        frames.receivers_part(
            templates, seen, sky, clocks_s, craft.vehicle.clock_domain, state, np.count_nonzero(known)
        ),
        frames.almanac_part(templates, sky.index[rows], sender, predicted),
        templates.heartbeats,
    )
    block, sent = e2e.protect(craft.codec, frames.block(parts, mark_ns), unit.sent, epoch)
    return RecordedUnit(sent, unit.refused), block


def _as_played(craft: RecordedCraft, sky: SkyState) -> Broadcast:
    """What receivers report of a sky. Precise orbits have no frequencies: what the receiver tuned to counts.
    Nor have they group delays: ranges of one carrier lack them, and are that much less accurate."""
    # GPS has the one delay, GLONASS the other.
    said = sky.broadcast
    tuned = craft.frequency[sky.index]
    lacking = craft.of_one_carrier[satellites.system_of(sky.index)]
    lacking &= (said.group_delay_m == 0) & (said.band_delay_m == 0)
    return replace(
        said,
        frequency=np.where(tuned != 0, tuned, said.frequency),
        ura=np.where(lacking & (said.ura == PRECISE), WITHOUT_GROUP_DELAY, said.ura),
    )


def truth(craft: RecordedCraft, epoch: int) -> NDArray:
    """One row of truth: the reference orbit at the mark, nan without one; what clocks showed is unknown.
    In view are the satellites that were observed."""
    row = np.zeros((), TRUTH)
    row["t_gps_ns"] = craft.marks_ns[epoch]
    for name in ("position_ecef_m", "velocity_ecef_mps", "clock_s"):
        row[name] = np.nan
    if craft.orbit is not None and craft.orbit.holds(int(craft.marks_ns[epoch])):
        state = craft.orbit.at(int(craft.marks_ns[epoch]))
        row["position_ecef_m"], row["velocity_ecef_mps"] = state.pos_ecef_m, state.vel_ecef_mps
    row["quaternion_body_from_ecef"] = AS_ECEF
    row["rate_body_rps"] = EARTH_RATE_RPS
    seen = np.unique(craft.tracks.sat[craft.bounds[epoch] : craft.bounds[epoch + 1]])
    row["in_view"], row["satellites_visible"] = in_view_bits(seen), len(seen)
    return row
