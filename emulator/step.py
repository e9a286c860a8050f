"""One epoch of the emulator: a pure function from truth's state and the commands heard to frames.

Commands sent in epoch k arrive here with epoch k + 1, act at once and are answered in this block.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc import e2e, satellites
from dbc.codec import Codec
from dbc.frames import EMPTY, SFF_MASK, FrameBatch
from dbc.gpstime import NS_PER_S
from dbc.vehicle import Vehicle
from emulator.factors.registry import Factor
from emulator.receivers import almanac, commands, frames, search
from emulator.receivers.channels import Channels, Flags, Knowledge, Numbers, Pace, advance, retarget
from emulator.receivers.observe import observe
from emulator.scenario import Receivers
from emulator.signals import clock, draws, geometry, link, view
from emulator.truth import TRUTH, in_view_bits
from emulator.world.attitude import Attitude
from emulator.world.orbit import CraftState, Orbit
from emulator.world.rotations import dcm_of_quaternion
from emulator.world.sky import Sky, SkyState


@dataclass(frozen=True, slots=True, eq=False)
class CraftWorld:
    """What does not change of one craft.

    key              64 bits that stand for its name in the random draws
    settings         receivers' parameters of the scenario
    factors          error factors that are on, by name
    wander           its oscillators
    epochs_per_pass  epochs in which the almanac is sent once
    """

    name: str
    key: int
    vehicle: Vehicle
    orbit: Orbit
    attitude: Attitude
    settings: Receivers
    pace: Pace
    rule: search.Rule
    factors: Mapping[str, Factor]
    wander: clock.Wander
    epochs_per_pass: int
    codec: Codec
    stationery: frames.Stationery


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """What does not change in a run. row_of (SATELLITES,) row of the sky by satellite index, -1 none."""

    seed: int
    session: int
    start_ns: int
    interval_ns: int
    leap_s: int
    ray_height_m: float
    sky: Sky
    row_of: Numbers
    systems: int
    craft: tuple[CraftWorld, ...]


@dataclass(frozen=True, slots=True, eq=False)
class UnitState:
    """One craft between epochs.

    sent, heard   counters of protected streams, as sender and receiver
    refused       (verdicts,) command frames rejected so far, by `dbc.e2e.Verdict`
    """

    channels: Channels
    knowledge: Knowledge
    sent: NDArray[np.int8]
    heard: NDArray[np.int8]
    refused: Numbers


@dataclass(frozen=True, slots=True, eq=False)
class EmulatorState:
    """All craft between epochs, in the scenario's order."""

    units: tuple[UnitState, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One epoch as a craft meets it.

    in_sight  (n,) available and not behind the Earth
    signal    (m, n) strong enough, inside the antenna's field of view
    clock_s   offset (m,) [s] and rate (m,) [s/s] of each receiver's clock;  by_domain_s (8,) offsets
    """

    t_ns: int
    sky: SkyState
    motion: geometry.Motion
    state: CraftState
    quaternion: NDArray[np.float64]
    rate_body_rps: NDArray[np.float64]
    antennas: geometry.Antennas
    view: view.View
    cn0_dbhz: NDArray[np.float64]
    in_sight: Flags
    signal: Flags
    clock_s: tuple[NDArray[np.float64], NDArray[np.float64]]
    by_domain_s: NDArray[np.float64]


def emulate_step(
    world: World, state: EmulatorState, inbox: Mapping[str, FrameBatch], epoch: int
) -> tuple[EmulatorState, dict[str, FrameBatch], NDArray]:
    """Play one epoch.

    inbox    frames heard since the last epoch, by name of the craft whose bus they were on
    returns  next state; frames by craft; truth (crafts,) of dtype `emulator.truth.TRUTH`
    """
    t_ns = world.start_ns + epoch * world.interval_ns
    sky = world.sky.at(t_ns)
    motion = geometry.inertial(sky)
    units, sent, truth = [], {}, np.zeros(len(world.craft), TRUTH)
    for number, (craft, unit) in enumerate(zip(world.craft, state.units, strict=True)):
        scene = _scene(world, craft, sky, motion, t_ns)
        unit, sent[craft.name] = _craft_step(world, craft, unit, scene, inbox.get(craft.name, EMPTY), epoch)
        units.append(unit)
        _tell_truth(truth[number], number, scene)
    return EmulatorState(tuple(units)), sent, truth


def _scene(world: World, craft: CraftWorld, sky: SkyState, motion: geometry.Motion, t_ns: int) -> Scene:
    """Geometry, link budget and clocks of one craft."""
    vehicle, settings = craft.vehicle, craft.settings
    state = craft.orbit.at(t_ns)
    quaternion, rate = craft.attitude.at(t_ns, state)
    dcm = dcm_of_quaternion(quaternion)
    antennas = geometry.antennas(state, dcm, rate, vehicle.lever_arm_body_m, vehicle.boresight_body)
    sight = view.look(motion, state.pos_ecef_m, antennas)
    cn0_dbhz = link.cn0_dbhz(
        satellites.system_of(sky.index), sight.distance_m, sight.angle_rad,
        settings.gain_dbi, settings.gain_at_90deg_dbi, settings.noise_temperature_k,
    )  # fmt: skip
    in_sight = sky.available & view.in_sight(sight, world.ray_height_m)
    signal = in_sight & (sight.angle_rad <= vehicle.mask_rad[:, None])
    signal &= cn0_dbhz >= settings.lock_threshold_dbhz
    offset_s, drift = clock.offset_s(craft.wander, (t_ns - world.start_ns) / NS_PER_S)
    by_receiver = offset_s[vehicle.clock_domain], drift[vehicle.clock_domain]
    return Scene(
        t_ns, sky, motion, state, quaternion, rate, antennas, sight, cn0_dbhz, in_sight, signal, by_receiver,
        offset_s,
    )  # fmt: skip


def _craft_step(
    world: World, craft: CraftWorld, unit: UnitState, scene: Scene, heard: FrameBatch, epoch: int
) -> tuple[UnitState, FrameBatch]:
    """The receivers of one craft: hear, choose, track, measure, send."""
    t_ns, sky, paper = scene.t_ns, scene.sky, craft.stationery
    channels, counters, refused, answers = _hear(world, craft, unit, scene, heard)
    target = search.choose(craft.rule, channels, scene.signal & sky.healthy, scene.view, sky.index)
    channels = retarget(channels, channels.commanded, target, t_ns)
    channels, knowledge, begins = advance(channels, unit.knowledge, scene.signal, craft.pace, t_ns)
    words = draws.grid(world.seed, craft.key, epoch, world.systems) if craft.factors else None
    seen, channels = observe(
        channels,
        begins,
        sky,
        scene.motion,
        scene.antennas,
        scene.clock_s,
        scene.cn0_dbhz,
        craft.factors,
        words,
    )
    rows, sender = almanac.portion(sky.available, epoch, craft.epochs_per_pass, craft.vehicle.antennas)
    state = _receiver_state(channels, craft.vehicle.channels, knowledge)
    mark, attitude = frames.head_parts(
        paper, world.session, epoch, t_ns, world.leap_s, scene.quaternion, scene.rate_body_rps
    )
    parts = (
        mark,
        *answers,
        attitude,
        frames.receivers_part(paper, seen, sky, scene.clock_s[0], craft.vehicle.clock_domain, state),
        frames.almanac_part(paper, rows, sender, sky),
        paper.heartbeats,
    )
    block, sent = e2e.protect(craft.codec, frames.block(parts, t_ns), unit.sent, epoch)
    return UnitState(channels, knowledge, sent, counters, refused), block


def _hear(
    world: World, craft: CraftWorld, unit: UnitState, scene: Scene, heard: FrameBatch
) -> tuple[Channels, NDArray[np.int8], Numbers, tuple[frames.Part, ...]]:
    """Obey the commands among the frames heard.

    returns  channels, counters of the streams heard, command frames rejected so far, answers to send
    A command that fails the checks of the bus is counted, not answered: nobody knows what it said.
    """
    kind = craft.codec.kind_of[heard.can_id & SFF_MASK]
    mine = heard[kind == craft.codec.kinds["COMMAND"].number]
    if not len(mine):
        return unit.channels, unit.heard, unit.refused, ()
    checked = e2e.screen(craft.codec, mine, unit.heard)
    refused = unit.refused + np.bincount(checked.verdict, minlength=len(e2e.Verdict))
    refused[[e2e.Verdict.OK, e2e.Verdict.LOST]] = 0
    orders = commands.read(craft.codec, checked.frames)
    prospects = commands.Prospects(world.row_of, scene.sky.available, scene.sky.healthy, scene.in_sight)
    channels, result = commands.obey(unit.channels, orders, craft.vehicle.channels, prospects, scene.t_ns)
    answers = (frames.answers_part(craft.stationery, orders, result),) if len(orders) else ()
    return channels, checked.counters, refused, answers


def _receiver_state(channels: Channels, counts: Numbers, knowledge: Knowledge) -> NDArray[np.int64]:
    """(m,) START while the unit is cold, COMMANDED once a command has set any channel of a receiver."""
    exists = np.arange(channels.commanded.shape[1]) < counts[:, None]
    obeys = (channels.commanded & exists).any(axis=1)
    name = frames.RECEIVER_STATE
    return np.where(obeys, name["COMMANDED"], name["AUTONOMOUS"] if knowledge.warm else name["START"])


def _tell_truth(row: np.void, number: int, scene: Scene) -> None:
    """Fill in one row of truth."""
    usable = scene.sky.index[(scene.signal & scene.sky.healthy).any(axis=0)]
    row["t_gps_ns"] = scene.t_ns
    row["craft"] = number
    row["position_ecef_m"] = scene.state.pos_ecef_m
    row["velocity_ecef_mps"] = scene.state.vel_ecef_mps
    row["quaternion_body_from_ecef"] = scene.quaternion
    row["rate_body_rps"] = scene.rate_body_rps
    row["clock_s"] = scene.by_domain_s
    row["in_view"] = in_view_bits(usable)
    row["satellites_visible"] = len(usable)
