"""Blocks: what is true for a craft in some epochs one after another, whatever its receivers do.

A block is a pure function of the world and its first epoch. It is worked out at once, because most of what an
epoch costs is not arithmetic: arrays over sixty-four epochs take little longer than arrays over one.

A run's last block ends with the run: nothing is asked of files and orbits beyond.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.attitude.turning import Attitude
from gnss_hil.emulator.constellation.sky import Sky, SkyState
from gnss_hil.emulator.earth.sun_table import Sun
from gnss_hil.emulator.environment import models as joined
from gnss_hil.emulator.environment.carrier_to_noise import Link, cn0_dbhz
from gnss_hil.emulator.environment.models import Clocks, Models
from gnss_hil.emulator.error_models.base import AttitudeTerm, Epochs
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternions
from gnss_hil.emulator.orbits.motion import Motion
from gnss_hil.emulator.signal import geometry, visibility
from gnss_hil.emulator.signal.bands import BY_SIGNAL, wavelength_m
from gnss_hil.emulator.signal.carriers import Carriers
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry
from gnss_hil.emulator.signal.structure import poses
from gnss_hil.emulator.signal.structure.bodies import Structure

EPOCHS = 64
FEWEST = 4
UNHURRIED_S = 1.0
"""A block has so many epochs; fewer where a pace leaves less time than this between two of them, in which
the next block is worked out."""


def epochs_at(period_s: float | None) -> int:
    """How many epochs a block has where so much wall time passes from one to the next; None: none passes
    but for the work itself."""
    return EPOCHS if period_s is None else int(np.clip(EPOCHS * period_s / UNHURRIED_S, FEWEST, EPOCHS))


class SkyCache:
    """The sky and its inertial motion at the times asked last: craft that latch together share it."""

    def __init__(self, sky: Sky, keep: int = 2):
        self.sky, self._keep = sky, keep
        self._held: OrderedDict[bytes, tuple[SkyState, geometry.Motion]] = OrderedDict()

    def over(self, t_ns: I64) -> tuple[SkyState, geometry.Motion]:
        key = t_ns.tobytes()
        if key not in self._held:
            state = self.sky.over(t_ns)
            self._held[key] = state, geometry.inertial(state)
            if len(self._held) > self._keep:
                self._held.popitem(last=False)
        return self._held[key]


@dataclass(frozen=True, slots=True, eq=False)
class Environment:
    """What the environment of one craft is made of.

    epochs        of the run;  block_epochs: of one block, see `epochs_at`
    ray_height_m  a ray that passes the Earth lower is hidden
    orbit, attitude, clocks   of the craft
    mark_domain   clock domain that time marks are read from, -1: GPS time, less what the computer's clock
                  is off
    lock_threshold_dbhz   from which a signal is found
    carriers      signals that the receivers can track
    others_db, others_m   of signals beside the first: gain of the antennas relative to the first ones', phase
                  centre beyond the first ones' along the boresight
    """

    start_ns: int
    interval_ns: int
    epochs: int
    block_epochs: int
    ray_height_m: float
    sky: SkyCache
    sun: Sun
    vehicle: Vehicle
    orbit: Motion
    attitude: Attitude
    clocks: Clocks
    mark_domain: int
    models: Models
    link: Link
    lock_threshold_dbhz: float
    structure: Structure | None
    carriers: Carriers
    others_db: float
    others_m: float

    def span(self, epoch: int) -> tuple[int, int]:
        """First epoch of the block of an epoch, and of the next."""
        first = epoch - epoch % self.block_epochs
        end = first + self.block_epochs
        if first < self.epochs < end:
            return (first, self.epochs) if epoch < self.epochs else (self.epochs, end)
        return first, end


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """k epochs of a craft; m antennas, n satellites of the sky, c columns of satellites and signals (see
    `gnss_hil.emulator.signal.carriers`).

    geometry    where everything is
    cn0_dbhz    (k, m, c), -inf of what is not in sight or is not sent
    in_sight    (k, n) available and not behind the Earth
    hidden      (k, m, c) inside the field of view, and the craft's structure in the way
    signal      (k, m, c) strong enough to be found, inside the antenna's field of view
    held        (k, m, c) strong enough to be held once it is tracked; None: what is found is held
    reported    what the reported attitude is off, None: nothing
    marked      centre of mass at the time marks, (k, 3) position [m] and velocity [m/s]
    """

    geometry: EpochGeometry
    cn0_dbhz: F64
    in_sight: Bool
    hidden: Bool
    signal: Bool
    held: Bool | None
    reported: AttitudeTerm | None
    marked: tuple[F64, F64]

    @property
    def first(self) -> int:
        return int(self.geometry.epoch[0])

    @property
    def receivable(self) -> Bool:
        """(k, m, c) signals that a channel may measure."""
        return self.signal if self.held is None else self.signal | self.held


def build_block(env: Environment, first: int) -> Block:
    """The block that begins with an epoch."""
    epochs = Epochs(first, env.span(first)[1] - first, env.start_ns, env.interval_ns)
    at = epoch_geometry(env, epochs)
    in_sight = at.sky.broadcast.available & (at.view.ray_height_m >= env.ray_height_m)
    in_field = in_sight[:, None] & (at.view.angle_rad <= env.vehicle.mask_rad[:, None])
    terms = joined.visibility(env.models, at)
    hidden = joined.hidden(terms, in_field)
    level = _levels(env, at, in_sight)
    if env.carriers.ranks > 1:
        sent = env.carriers.reaches[:, :, at.sky.index].swapaxes(0, 1).reshape(level.shape[1], -1)
        in_field, hidden = (np.tile(each, env.carriers.ranks) & sent for each in (in_field, hidden))
    if hidden.any():
        epoch, antenna, column = np.nonzero(hidden)
        pairs = channel_geometry(env, at, level, hidden, epoch, antenna, column)
        level[hidden] += joined.path_models(env.models).reaching(pairs)
    return Block(
        geometry=at,
        cn0_dbhz=level,
        in_sight=in_sight,
        hidden=hidden,
        signal=in_field & (level >= env.lock_threshold_dbhz),
        held=joined.held(terms, in_field, level),
        reported=joined.attitude(env.models, epochs),
        marked=_marked(env, at),
    )


def _levels(env: Environment, at: EpochGeometry, in_sight: Bool) -> F64:
    """(k, m, c) C/N0 [dBHz] of what is in sight and sent, nothing in the way; -inf of all else."""
    carriers, (k, m, n) = env.carriers, at.view.angle_rad.shape
    level = np.full((k, m, carriers.ranks * n), -np.inf)
    system = satellites.system_of(at.sky.index)
    for rank, signal in enumerate(carriers.signal):
        sent = carriers.reaches[rank][:, at.sky.index]
        epoch, row = np.nonzero(in_sight if rank == 0 else in_sight & sent.any(axis=0))
        found = cn0_dbhz(env.link, at, epoch, row, signal[system[row]])
        if rank > 0:
            found = np.where(sent[:, row], found + env.others_db, -np.inf)
        level[epoch, :, rank * n + row] = found.T
    return level


def epoch_geometry(env: Environment, epochs: Epochs) -> EpochGeometry:
    """Where everything is when the receivers latch."""
    clock = env.clocks(epochs)
    by_clock = env.mark_domain >= 0
    ahead_s = clock[:, 0, env.mark_domain] if by_clock else joined.ahead_s(env.models, epochs)
    mark_ns = epochs.mark_ns
    t_ns = mark_ns - np.rint(ahead_s * NS_PER_S).astype(np.int64)
    sky, motion = env.sky.over(t_ns)
    state = env.orbit.over(t_ns)
    quaternion, rate = env.attitude.over(t_ns, state)
    dcm = dcm_of_quaternions(quaternion)
    vehicle = env.vehicle
    antennas = geometry.antennas(state, dcm, rate, vehicle.lever_arm_body_m, vehicle.boresight_body)
    view = visibility.look(motion, state.pos_ecef_m, antennas.boresight, env.ray_height_m)
    sun_m = env.sun.over(t_ns)
    structure = None
    if env.structure is not None:
        since_s = (t_ns - env.start_ns) / NS_PER_S
        sight = poses.sight_lines(view, motion, state, dcm, rate)
        sun = poses.sun_body(dcm, sun_m, state)
        structure = poses.poses(env.structure, vehicle, sight, sun, rate, since_s)
    return EpochGeometry(
        epoch=epochs.number,
        mark_ns=mark_ns,
        t_ns=t_ns,
        ahead_s=ahead_s,
        clock=clock,
        sky=sky,
        motion=motion,
        state=state,
        quaternion=quaternion,
        dcm_body_from_ecef=dcm,
        rate_body_rps=rate,
        antennas=antennas,
        view=view,
        sun_ecef_m=sun_m,
        structure=structure,
    )


def channel_geometry(
    env: Environment,
    at: EpochGeometry,
    level_dbhz: F64,
    hidden: Bool,
    epoch: I64,
    antenna: I64,
    column: I64,
) -> ChannelGeometry:
    """Signals in these columns at antennas in epochs of a block, (p,) each; level and hidden (k, m, c)."""
    rank, row = env.carriers.place(column, len(at.sky.index))
    sat = at.sky.index[row]
    system = satellites.system_of(sat)
    signal = env.carriers.signal[rank, system]
    antenna_m = at.antennas.pos_m[epoch, antenna]
    if env.others_m:
        antenna_m = antenna_m + env.others_m * (rank > 0)[:, None] * at.antennas.boresight[epoch, antenna]
    return ChannelGeometry(
        epochs=at,
        at=epoch,
        receiver=antenna,
        row=row,
        sat=sat,
        system=system,
        signal=signal,
        wave_m=wavelength_m(signal, at.sky.broadcast.frequency[epoch, row]),
        chip_m=BY_SIGNAL.chip_m[signal],
        cn0_dbhz=level_dbhz[epoch, antenna, column],
        path=geometry.path(at.motion[epoch, row], antenna_m, at.antennas.vel_mps[epoch, antenna]),
        hidden=hidden[epoch, antenna, column],
        antennas=env.link.antennas,
    )


def with_level(at: ChannelGeometry, cn0: F64) -> ChannelGeometry:
    """The same signals of another strength (p,) [dBHz]."""
    return replace(at, cn0_dbhz=cn0)


def _marked(env: Environment, at: EpochGeometry) -> tuple[F64, F64]:
    state = at.state if np.array_equal(at.t_ns, at.mark_ns) else env.orbit.over(at.mark_ns)
    return state.pos_ecef_m, state.vel_ecef_mps
