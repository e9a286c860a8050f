"""One epoch of the flight software: a pure function from state and frames to state and frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.dbc.common.shipped_files import faults
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec, codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import MAX_RECEIVERS
from gnss_hil.flightsw.assignment import angles
from gnss_hil.flightsw.assignment.boresight import boresights_ecef
from gnss_hil.flightsw.assignment.registry import Options, Policy, policy
from gnss_hil.flightsw.attitude.attitude import Attitude, attitude_now
from gnss_hil.flightsw.estimation.fix_inputs import Circumstances
from gnss_hil.flightsw.estimation.position import Fix, NoFix
from gnss_hil.flightsw.estimation.propagate_to_mark import at_mark
from gnss_hil.flightsw.integrity.exclusion import Rules
from gnss_hil.flightsw.io import decode, encode
from gnss_hil.flightsw.io.epoch import Epoch, Mark, Measurements
from gnss_hil.flightsw.io.frame_statistics import no_rejections
from gnss_hil.flightsw.measurement.ionosphere_free import ionosphere_free
from gnss_hil.flightsw.measurement.noise import NO_URA, Noise
from gnss_hil.flightsw.measurement.observables import Ranges, of_one_signal
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.orbit.propagator import propagate
from gnss_hil.flightsw.receivers import channel_manager
from gnss_hil.flightsw.receivers.channel_manager import ChannelManager, Commands

FULL_LOCK = 5
"""Only with frame synchronisation is a pseudorange free of the code's ambiguity."""

MAX_COAST_S = 3600.0
"""After so long the position is forgotten and the next fix starts cold."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightConfig:
    vehicle: Vehicle
    codec: Codec
    policy: Policy
    options: Options
    boot_count: int


@dataclass(frozen=True, slots=True)
class Navigation:
    """Where the craft is, by the last fix or carried on from it; epochs since that fix.

    The velocity is that of the last fix that had one, carried on; None if there was none.
    """

    t_ns: int
    position_m: NDArray[np.float64]
    velocity_mps: NDArray[np.float64] | None
    age: int


@dataclass(frozen=True, slots=True)
class FlightState:
    """All that one epoch hands to the next.

    mark       the last time mark, None before the first
    rejected   (REASONS, identifiers) frames not used; `flightsw.io.frame_statistics.rejection_table` explains
    without_fix   epochs since the last fix, or since the start
    leading    antenna that leads, for policies in which one does; -1 none
    """

    mark: Mark | None
    received: NDArray[np.int8]
    sent: NDArray[np.int8]
    rejected: NDArray[np.int64]
    lost: int
    attitude: Attitude | None
    navigation: Navigation | None
    predictions: almanac.Predictions
    channels: ChannelManager
    without_fix: int
    fix: Fix | NoFix
    leading: int


def configure(
    vehicle: Vehicle, policy_name: str, options: Mapping[str, object] | None = None, boot_count: int = 0
) -> FlightConfig:
    """What stays the same for a run. ValueError says what is wrong with the policy or its options."""
    row = policy(policy_name)
    try:
        values = row.options.model_validate(dict(options or {}))
    except ValidationError as error:
        raise ValueError("\n".join(faults(error, f"policy '{row.name}'"))) from None
    return FlightConfig(vehicle, codec(vehicle.antennas), row, values, boot_count % 256)


def heartbeat(config: FlightConfig) -> FrameBatch:
    """The heartbeat before the first epoch: counter 0, always the same."""
    frames = encode.heartbeat(config.codec, encode.NodeState.READY, config.boot_count, 0)
    return e2e.protect(config.codec, frames, e2e.fresh_counters(), 0)[0]


def initial_state(config: FlightConfig) -> FlightState:
    """Nothing known; the heartbeat of the start barrier has been sent."""
    first = encode.heartbeat(config.codec, encode.NodeState.READY, config.boot_count, 0)
    _, sent = e2e.protect(config.codec, first, e2e.fresh_counters(), 0)
    return FlightState(
        mark=None,
        received=e2e.fresh_counters(),
        sent=sent,
        rejected=no_rejections(),
        lost=0,
        attitude=None,
        navigation=None,
        predictions=almanac.no_predictions(),
        channels=channel_manager.autonomous(config.vehicle.channels, MAX_RECEIVERS),
        without_fix=0,
        fix=NoFix.NO_TIME_MARK,
        leading=-1,
    )


def flight_step(
    config: FlightConfig, state: FlightState, inbox: FrameBatch
) -> tuple[FlightState, FrameBatch]:
    """The block of frames that answers a block of frames. Never raises on what a bus may carry."""
    if state.mark is not None:
        session = state.mark.session
        inbox, rejected, restarted = decode.admitted(config.codec, inbox, session, state.rejected)
        # What was counted stays counted; all else belongs to the session.
        state = replace(initial_state(config) if restarted else state, rejected=rejected, lost=state.lost)
    epoch, received, rejected = decode.decode(config.codec, inbox, state.received, state.rejected)
    state = replace(state, received=received, rejected=rejected, lost=state.lost + epoch.lost)
    if epoch.mark is None:
        return _answer(config, replace(state, fix=NoFix.NO_TIME_MARK), None, None, state.mark)
    state, offered = _navigate(config, state, epoch)
    state, commands = _command(config, state, epoch)
    return _answer(config, state, offered, commands, epoch.mark)


def _navigate(config: FlightConfig, state: FlightState, epoch: Epoch) -> tuple[FlightState, Ranges]:
    """Blocks 3 and 4: the fix of this epoch, and the ranges offered to it."""
    t_ns, options = epoch.mark.t_ns, config.options
    attitude = attitude_now(epoch.attitude, state.attitude, t_ns, options.attitude_hold_epochs)
    commanding = channel_manager.contradicted(
        channel_manager.acknowledged(state.channels, epoch.acks, epoch.mark.epoch, options),
        epoch.measurements,
        epoch.boots,
    )
    m = epoch.measurements
    sound = _sound(m)
    predictions = almanac.updated(state.predictions, epoch.almanac, m.where(sound), t_ns)
    offered = _ranges(m.where(sound & (m.health == 0) & channel_manager.usable(commanding, m)), options)
    navigation = _carried(state.navigation, t_ns)
    circumstances = Circumstances(
        attitude,
        config.vehicle.lever_arm_body_m,
        _domains(config, epoch),
        None if navigation is None else navigation.position_m,
        options.ura_scale,
        Rules(options.exclude_satellites, options.inconsistent == "refuse"),
        state.leading,
    )
    fix, leading = config.policy.combine(offered, circumstances)
    carried = None if navigation is None else navigation.velocity_mps
    if isinstance(fix, Fix):
        fix = at_mark(fix, epoch.mark.clock, carried)
    if isinstance(fix, Fix):
        velocity = carried if fix.velocity_mps is None else fix.velocity_mps
        navigation = Navigation(t_ns, fix.position_m, velocity, 0)
        if commanding.commanded:
            commanding = channel_manager.used(commanding, offered.sat[fix.used], epoch.mark.epoch)
    state = replace(
        state,
        mark=epoch.mark,
        attitude=attitude,
        navigation=navigation,
        predictions=predictions,
        channels=commanding,
        without_fix=0 if isinstance(fix, Fix) else state.without_fix + 1,
        fix=fix,
        leading=leading,
    )
    return state, offered


def _ranges(m: Measurements, options: Options) -> Ranges:
    """What the measurements say, one row for each antenna and satellite."""
    noise = Noise(options.code_floor_m, options.code_noise_m, options.rate_floor_mps, options.rate_noise_mps)
    return (ionosphere_free if options.ionosphere_free else of_one_signal)(m, noise)


def _sound(m: Measurements) -> NDArray[np.bool_]:
    """(n,) with an unambiguous range and a satellite that moves as satellites can."""
    return (m.lock == FULL_LOCK) & (m.ura < NO_URA) & almanac.plausible(m.sat, m.pos_sv_m, m.vel_sv_mps)


def _carried(navigation: Navigation | None, t_ns: int) -> Navigation | None:
    """The last position carried on to now; without a velocity it leads nowhere."""
    if navigation is None or navigation.velocity_mps is None:
        return None
    dt_s = (t_ns - navigation.t_ns) * 1e-9
    if not 0 <= dt_s <= MAX_COAST_S:
        return None
    position, velocity = propagate(navigation.position_m, navigation.velocity_mps, dt_s)
    return Navigation(t_ns, position, velocity, navigation.age + 1)


def _domains(config: FlightConfig, epoch: Epoch) -> NDArray[np.int64]:
    """(m,) clock domain of each antenna: as its receiver says, else as the vehicle file says."""
    said = epoch.domains[: config.vehicle.antennas]
    return np.where(said >= 0, said, config.vehicle.clock_domain)


def _command(config: FlightConfig, state: FlightState, epoch: Epoch) -> tuple[FlightState, Commands | None]:
    """Blocks 5 to 9: permissions from the position (fixed or carried on) and attitude of this epoch.

    Without either the permissions stand as they are; commands under way are still repeated.
    """
    if config.policy.assign is None:
        return state, None
    commanding = state.channels
    if state.without_fix >= config.options.autonomy_after_epochs:
        if commanding.commanded:
            commanding = channel_manager.surrendered(commanding)
    elif state.navigation is not None and state.attitude is not None:
        commanding = channel_manager.planned(commanding, _permissions(config, state), epoch.measurements)
    commanding, commands = channel_manager.due(commanding, epoch.mark.epoch, config.options)
    return replace(state, channels=commanding), commands


def _permissions(config: FlightConfig, state: FlightState) -> NDArray[np.int64]:
    """Steps 6 to 9: (SATELLITES,) antenna each satellite is permitted on, -1 none."""
    vehicle, position = config.vehicle, state.navigation.position_m
    sat, pos_sv = almanac.predicted(state.predictions, state.mark.t_ns)
    los, distance = angles.directions(pos_sv, position)
    theta = angles.angles_rad(los, boresights_ecef(state.attitude, vehicle.boresight_body))
    visible = angles.clear_of_earth(los, distance, position, config.options.ray_height_km * 1e3)
    visible &= state.predictions.healthy[sat] & (
        state.channels.satellites.blocked_until[sat] <= state.mark.epoch
    )
    permitted = np.full(SATELLITES, -1, np.int64)
    permitted[sat] = config.policy.assign(
        theta,
        visible,
        vehicle.mask_rad,
        vehicle.channels,
        state.channels.satellites.permitted[sat],
        config.options,
    )
    return permitted


def _answer(
    config: FlightConfig, state: FlightState, m: Ranges | None, commands: Commands | None, mark: Mark | None
) -> tuple[FlightState, FrameBatch]:
    t_ns, number = (mark.t_ns, mark.epoch) if mark is not None else (0, 0)
    frames = encode.block(
        config.codec, config.vehicle.antennas, config.boot_count, m, state.fix, commands, t_ns
    )
    frames, sent = e2e.protect(config.codec, frames, state.sent, number)
    return replace(state, sent=sent), frames
