"""One epoch of the emulator: a pure function from truth's state and the commands heard to frames.

Commands sent in epoch k arrive here with epoch k + 1, act at once and are answered in this block.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import EMPTY, SFF_MASK, FrameBatch
from gnss_hil.emulator.constellation.sky import Sky, SkyState
from gnss_hil.emulator.epoch_geometry import scene_of
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.emulated import almanac, commands, search
from gnss_hil.emulator.receivers.emulated.channels import (
    Channels,
    Knowledge,
    Numbers,
    advance,
    receivable,
    retarget,
)
from gnss_hil.emulator.receivers.emulated.observables import observe
from gnss_hil.emulator.receivers.recorded import receiver as observed
from gnss_hil.emulator.receivers.recorded.receiver import ObservedCraft, ObservedUnit
from gnss_hil.emulator.sensors import attitude_determination
from gnss_hil.emulator.signal import geometry
from gnss_hil.emulator.signal.epoch_geometry import Scene
from gnss_hil.emulator.state import CraftWorld, EmulatorState, UnitState, World
from gnss_hil.emulator.truth import TRUTH, in_view_bits


def emulate_step(
    world: World, state: EmulatorState, inbox: Mapping[str, FrameBatch], epoch: int
) -> tuple[EmulatorState, dict[str, FrameBatch], NDArray]:
    """Play one epoch.

    inbox    frames heard since the last epoch, by name of the craft whose bus they were on
    returns  next state; frames by craft; truth (crafts,) of dtype `emulator.truth.TRUTH`
    """
    heavens = Heavens(world.sky)
    units, sent, truth = [], {}, np.zeros(len(world.craft), TRUTH)
    for number, (craft, unit) in enumerate(zip(world.craft, state.units, strict=True)):
        heard = inbox.get(craft.name, EMPTY)
        play = _play_observed if isinstance(craft, ObservedCraft) else _play
        unit, sent[craft.name], truth[number] = play(world, craft, unit, heavens, heard, epoch)
        truth[number]["craft"] = number
        units.append(unit)
    return EmulatorState(tuple(units)), sent, truth


class Heavens(dict):
    """The sky and its motion by GPS time, for as long as an epoch: craft that latch together share it."""

    def __init__(self, sky: Sky):
        self._sky = sky

    def __missing__(self, t_ns: int) -> tuple[SkyState, geometry.Motion]:
        state = self._sky.at(t_ns)
        self[t_ns] = state, geometry.inertial(state)
        return self[t_ns]


def _play_observed(
    world: World, craft: ObservedCraft, unit: ObservedUnit, heavens: Heavens, heard: FrameBatch, epoch: int
) -> tuple[ObservedUnit, FrameBatch, NDArray]:
    """A craft whose receiver is real, and hears nobody."""
    sky, _ = heavens[int(craft.marks_ns[epoch])]
    unit, block = observed.play(craft, unit, sky, world.almanac, world.row_of, world.session, epoch)
    return unit, block, observed.truth(craft, epoch)


def _play(
    world: World, craft: CraftWorld, unit: UnitState, heavens: Heavens, heard: FrameBatch, epoch: int
) -> tuple[UnitState, FrameBatch, NDArray]:
    """An emulated craft: when its receivers latch, what they do, and the truth of it."""
    mark_ns = world.start_ns + epoch * world.interval_ns
    clocks = craft.clocks(unit.clocks, epoch)
    ahead_s = craft.instant.ahead_s(clocks, epoch)
    t_ns = mark_ns - round(ahead_s * gpstime.NS_PER_S)
    scene = scene_of(world, craft, clocks, *heavens[t_ns], t_ns)
    believed = None
    if craft.sensors is not None:
        believed = attitude_determination.known(craft.sensors, unit.believed, world.seed, craft.key, epoch)
    unit = replace(unit, clocks=clocks, believed=believed)
    unit, block = _craft_step(world, craft, unit, scene, heard, epoch, ahead_s)
    return unit, block, _truth(craft, scene, mark_ns)


def _craft_step(
    world: World,
    craft: CraftWorld,
    unit: UnitState,
    scene: Scene,
    heard: FrameBatch,
    epoch: int,
    ahead_s: float,
) -> tuple[UnitState, FrameBatch]:
    """The receivers of one craft: hear, choose, track, measure, send."""
    t_ns, sky, paper = scene.t_ns, scene.sky, craft.stationery
    mark_ns = world.start_ns + epoch * world.interval_ns
    channels, counters, refused, answers = _hear(world, craft, unit, scene, heard, epoch)
    renews = search.renews(mark_ns, world.interval_ns)
    target = search.choose(craft.rule, channels, scene.signal & sky.healthy, scene.view, sky.index, renews)
    channels = retarget(channels, channels.commanded, target, t_ns)
    system = satellites.system_of(sky.index) if craft.by_frames else None
    signal = receivable(channels, scene.signal, scene.held)
    channels, knowledge, begins = advance(channels, unit.knowledge, signal, craft.pace, t_ns, system)
    words = keyed_draws.grid(world.seed, craft.key, epoch, world.systems) if craft.draws else None
    seen, channels = observe(channels, begins, scene, craft.effects, words, craft.carrier)
    known = almanac.contents(world.almanac, sky)
    rows, sender = almanac.portion(known, epoch, craft.epochs_per_pass, craft.vehicle.antennas)
    told = almanac.predictions(world.almanac, sky, rows, mark_ns)
    state = _receiver_state(channels, craft.vehicle.channels, knowledge)
    mark, attitude = frames.head_parts(
        paper, world.session, epoch, mark_ns, gpstime.leap_seconds(mark_ns), *_attitude(unit, scene),
        craft.instant.source,
    )  # fmt: skip
    parts = (
        mark,
        *answers,
        attitude,
        frames.receivers_part(
            paper,
            seen,
            sky,
            scene.clock_s[0] - ahead_s,
            craft.vehicle.clock_domain,
            state,
            np.count_nonzero(known),
        ),
        frames.almanac_part(paper, sky.index[rows], sender, told),
        paper.heartbeats,
    )
    block, sent = e2e.protect(craft.codec, frames.block(parts, mark_ns), unit.sent, epoch)
    state = replace(unit, channels=channels, knowledge=knowledge, sent=sent, heard=counters, refused=refused)
    return state, block


def _attitude(unit: UnitState, scene: Scene) -> tuple[NDArray, NDArray]:
    """Quaternion (4,) and rate (3,) as the on-board computer tells them."""
    if unit.believed is None:
        return scene.quaternion, scene.rate_body_rps
    quaternion = attitude_determination.believed(scene.quaternion, unit.believed.angle_rad)
    return quaternion, scene.rate_body_rps + unit.believed.rate_rps


def _hear(
    world: World, craft: CraftWorld, unit: UnitState, scene: Scene, heard: FrameBatch, epoch: int
) -> tuple[Channels, NDArray[np.int8], Numbers, tuple[frames.Part, ...]]:
    """Obey the commands among the frames heard.

    returns  channels, counters of the streams heard, command frames rejected so far, answers to send
    A command that fails the checks of the bus is counted, not answered: nobody knows what it said. So is one
    that does not answer an epoch just past (MIXED_EPOCH): whoever sent it has long decided otherwise.
    """
    kind = craft.codec.kind_of[heard.can_id & SFF_MASK]
    mine = heard[kind == craft.codec.kinds["COMMAND"].number]
    if not len(mine):
        return unit.channels, unit.heard, unit.refused, ()
    checked = e2e.screen(craft.codec, mine, unit.heard)
    refused = unit.refused + np.bincount(checked.verdict, minlength=len(e2e.Verdict))
    refused[[e2e.Verdict.OK, e2e.Verdict.LOST]] = 0
    timely = commands.timely(checked.frames, epoch)
    refused[e2e.Verdict.MIXED_EPOCH] += np.count_nonzero(~timely)
    orders = commands.read(craft.codec, checked.frames[timely])
    # Who knows neither time nor place cannot say what the Earth hides: it accepts, and searches in vain.
    in_sight = scene.in_sight | (not unit.knowledge.warm)
    prospects = commands.Prospects(world.row_of, scene.sky.available, scene.sky.healthy, in_sight)
    channels, result = commands.obey(unit.channels, orders, craft.vehicle.channels, prospects, scene.t_ns)
    answers = (frames.answers_part(craft.stationery, orders, result),) if len(orders) else ()
    return channels, checked.counters, refused, answers


def _receiver_state(channels: Channels, counts: Numbers, knowledge: Knowledge) -> NDArray[np.int64]:
    """(m,) START while the unit is cold, COMMANDED once a command has set any channel of a receiver."""
    exists = np.arange(channels.commanded.shape[1]) < counts[:, None]
    obeys = (channels.commanded & exists).any(axis=1)
    name = frames.RECEIVER_STATE
    return np.where(obeys, name["COMMANDED"], name["AUTONOMOUS"] if knowledge.warm else name["START"])


def _truth(craft: CraftWorld, scene: Scene, mark_ns: int) -> NDArray:
    """A row of truth: place and motion at the time the mark says, all else of the latch."""
    usable = scene.sky.index[(scene.signal & scene.sky.healthy).any(axis=0)]
    marked = scene.state if scene.t_ns == mark_ns else craft.orbit.at(mark_ns)
    row = np.zeros((), TRUTH)
    row["t_gps_ns"] = mark_ns
    row["position_ecef_m"] = marked.pos_ecef_m
    row["velocity_ecef_mps"] = marked.vel_ecef_mps
    row["quaternion_body_from_ecef"] = scene.quaternion
    row["rate_body_rps"] = scene.rate_body_rps
    row["clock_s"] = scene.by_domain_s
    row["in_view"] = in_view_bits(usable)
    row["satellites_visible"] = len(usable)
    return row
