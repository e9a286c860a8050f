"""One epoch of the flight software: a pure function from state and frames to state and frames.

io             decode: frames into the epoch's records, protection and nodes judged
attitude       this epoch's, or the last one turned on
receivers      answers to commands, and what contradicts them
measurement    form: channels that may enter a fix, as ranges
estimation     predict, update: the solution, faulty satellites excluded
integrity      assess, publishable: what the solution is worth, and whether it is one
app.modes      decide: the mode
assignment     satellites to antennas; receivers: the commands due
io             encode: solution, commands and heartbeat as frames
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.satellites import NUMBERS, SATELLITES
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.app import modes
from gnss_hil.flightsw.app.answer import answer
from gnss_hil.flightsw.app.config import FlightConfig, Options
from gnss_hil.flightsw.app.modes import GUIDANCE, Guidance, Mode
from gnss_hil.flightsw.app.state import FlightState, initial_state
from gnss_hil.flightsw.assignment.boresight_angles import (
    angles_rad,
    boresights_ecef,
    clear_of_earth,
    directions,
)
from gnss_hil.flightsw.assignment.pairs import in_pairs
from gnss_hil.flightsw.attitude.attitude import Attitude, attitude_now
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.dilution import with_dilution
from gnss_hil.flightsw.estimation.prior import LEAST_TRUSTED_S
from gnss_hil.flightsw.integrity import satellite_reports, time_marks
from gnss_hil.flightsw.integrity.assess import assess
from gnss_hil.flightsw.integrity.publishable import publishable
from gnss_hil.flightsw.integrity.satellite_reports import Reports
from gnss_hil.flightsw.integrity.time_marks import TimeMarks
from gnss_hil.flightsw.io import decode
from gnss_hil.flightsw.io.frame_statistics import Reason, Rejections
from gnss_hil.flightsw.io.reception import Reception
from gnss_hil.flightsw.measurement.ionosphere import USUAL, Ionosphere
from gnss_hil.flightsw.measurement.ionosphere_filter import Delays
from gnss_hil.flightsw.measurement.ionosphere_free import filtered, ionosphere_free
from gnss_hil.flightsw.measurement.observables import of_one_signal
from gnss_hil.flightsw.measurement.registry import other_measurements
from gnss_hil.flightsw.measurement.space import predicted
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.orbit.almanac import Predictions
from gnss_hil.flightsw.receivers import channel_manager
from gnss_hil.flightsw.receivers.channel_manager import ChannelManager
from gnss_hil.flightsw.records.commands import Commands
from gnss_hil.flightsw.records.epoch import Epoch, Mark, Measurements, empty_epoch
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import NoFix, OrbitState, Solution, SolutionError

FULL_LOCK = raw_of("Lock")["FULL"]
"""Only with frame synchronisation is a pseudorange free of the code's ambiguity."""

_ONE = np.ones(1, bool)

_NOWHERE = np.full(SATELLITES, -1, np.int64)


def flight_step(
    config: FlightConfig, state: FlightState, inbox: FrameBatch
) -> tuple[FlightState, FrameBatch]:
    """The block of frames that answers a block of frames. Never raises on what a bus may carry."""
    state, received, rejected, decoded = _received(config, state, inbox)
    reports = satellite_reports.judged(state.predictions, decoded, state.solution.orbit)
    marks, decoded, rejected = _timed(config, state, decoded, reports, rejected)
    if decoded.mark is None:
        return _timeless(config, state, decoded, marks, received, rejected)
    mark, options = decoded.mark, config.options
    m, t_ns = decoded.measurements, decoded.mark.t_ns
    attitude = attitude_now(decoded.attitude, state.attitude, t_ns, options.attitude_hold_epochs)
    if decoded.attitude is not None and attitude is not None and attitude.age:
        rejected = _counted(rejected, Reason.TURNED, config.codec.can_id_of["ATT_Q01", 0])
    channels = channel_manager.acknowledged(state.channels, decoded.acks, mark.epoch, options)
    restarted = channel_manager.restarted(channels, decoded.boots)
    channels = channel_manager.contradicted(channels, m, decoded.boots)

    rejected = _not_used(config, rejected, m, reports)
    sound = reports.sound & (m.lock == FULL_LOCK) & predicted(m.ura)
    predictions = almanac.updated(
        state.predictions, reports.almanac, m.where(sound), t_ns, reports.sent_ns[sound]
    )
    offered = m.where(sound & (m.health == 0) & channel_manager.usable(channels, m))
    delays, z = _form(offered, config, state.delays, t_ns)
    inputs = _fix_inputs(config, decoded, mark, attitude, restarted)

    nav, solution = _navigated(config, state.nav, t_ns, z, inputs)
    single = False
    if options.ionosphere_free and solution.fix is None and options.without_pairs == "one-signal":
        z, single = of_one_signal(offered, config.budget), True
        nav, solution = _navigated(config, state.nav, t_ns, z, inputs)
    if solution.fix is not None:
        in_fix = z.sat[solution.fix.used]
        if solution.orbit is not None and solution.orbit.trusted_s > LEAST_TRUSTED_S:
            predictions = almanac.proven(predictions, in_fix, t_ns)
        if channels.commanded:
            channels = channel_manager.used(channels, in_fix, mark.epoch)

    without_fix = 0 if solution.fix is not None else state.without_fix + 1
    mode = modes.decide(state.mode, modes.event_of(solution, without_fix, options))
    permitted = _permissions(config, mode, channels, predictions, solution.orbit, attitude, mark)
    channels, commands = _commanded(config, mode, channels, permitted, m, mark.epoch)
    after = FlightState(
        mode=mode,
        mark=mark,
        received=received,
        sent=state.sent,
        rejected=rejected,
        lost=state.lost + decoded.lost,
        attitude=attitude,
        nav=nav,
        solution=solution,
        predictions=predictions,
        channels=channels,
        without_fix=without_fix,
        single_fixes=state.single_fixes + (single and solution.fix is not None),
        delays=delays,
        marks=marks,
    )
    return answer(config, state, after, z, commands, mark)


def _timeless(
    config: FlightConfig,
    before: FlightState,
    decoded: Epoch,
    marks: TimeMarks,
    received: Reception,
    rejected: I64,
) -> tuple[FlightState, FrameBatch]:
    """An epoch without a time mark, or with one that is not believed: nothing in it is used."""
    solution = replace(before.solution, reason=NoFix.NO_TIME_MARK, fix=None)
    without_fix = before.without_fix + (before.mark is not None)
    state = replace(
        before,
        mode=modes.decide(before.mode, modes.event_of(solution, without_fix, config.options)),
        received=received,
        rejected=rejected,
        marks=marks,
        lost=before.lost + decoded.lost,
        solution=solution,
        without_fix=without_fix,
    )
    return answer(config, before, state, None, None, state.mark)


def _timed(
    config: FlightConfig, state: FlightState, decoded: Epoch, reports: Reports, rejected: I64
) -> tuple[TimeMarks, Epoch, I64]:
    """The marks after this one, the epoch, which is empty if its mark is not believed, and counts."""
    if decoded.mark is None:
        return state.marks, decoded, rejected
    marks, believed = time_marks.advanced(state.marks, decoded.mark, reports.agree)
    if believed:
        return marks, decoded, rejected
    rejected = _counted(rejected, Reason.JUMPED, config.codec.can_id_of["TIME_MARK", 0])
    return marks, empty_epoch(decoded.lost), rejected


def _counted(rejected: I64, reason: Reason, can_id: int) -> I64:
    """Counts with one more."""
    counts = Rejections(rejected)
    counts.add(reason, np.array([can_id]), _ONE)
    return counts.counts


def _not_used(config: FlightConfig, rejected: I64, m: Measurements, reports: Reports) -> I64:
    """Counts after channels whose reports are not believed, at the frame that closes a channel."""
    if reports.sound.all():
        return rejected
    counts = Rejections(rejected)
    closing = config.codec.can_id_of["SV_CLOCK", 1] + 0x10 * m.receiver
    counts.add(Reason.NO_ORBIT, closing, ~reports.in_orbit)
    counts.add(Reason.MOVED, closing, reports.in_orbit & reports.moved)
    return counts.counts


def _received(
    config: FlightConfig, state: FlightState, inbox: FrameBatch
) -> tuple[FlightState, Reception, I64, Epoch]:
    """The state to go on from, a fresh one if a session has begun; protection and counts after this block of
    frames; the epoch in it."""
    rejected = state.rejected
    if state.mark is not None:
        session = state.mark.session
        inbox, rejected, restarted = decode.admitted(config.codec, inbox, session, rejected)
        if restarted:
            # What was counted stays counted; all else belongs to the session.
            state = replace(
                initial_state(config),
                rejected=state.rejected,
                lost=state.lost,
                single_fixes=state.single_fixes,
            )
    decoded, received, rejected = decode.decode(config.codec, config.limits, inbox, state.received, rejected)
    return state, received, rejected, decoded


def _form(m: Measurements, config: FlightConfig, delays: Delays, t_ns: int) -> tuple[Delays, Ranges]:
    """Measurements as ranges, one row for each antenna and satellite, and the delays followed until then."""
    options = config.options
    if not options.ionosphere_free:
        return delays, of_one_signal(m, config.budget)
    if not options.ionosphere_walk_mps_rts:
        return delays, ionosphere_free(m, config.budget)
    return filtered(m, config.budget, delays, t_ns, options.ionosphere_walk_mps_rts)


def _ionosphere(options: Options, decoded: Epoch, mark: Mark) -> Ionosphere | None:
    """Over the craft, as ranges are to be corrected for it."""
    reported = {"auto": decoded.ionosphere, "usual": decoded.ionosphere or USUAL, "off": None}
    found = reported[options.ionosphere]
    return None if found is None else Ionosphere(found, (mark.t_ns * 1e-9) % 86_400.0)


def _fix_inputs(
    config: FlightConfig, decoded: Epoch, mark: Mark, attitude: Attitude | None, restarted: Bool
) -> FixInputs:
    vehicle, options = config.vehicle, config.options
    reported = decoded.domains[: vehicle.antennas]
    return FixInputs(
        attitude=attitude,
        lever_arm_body_m=vehicle.lever_arm_body_m,
        domain=np.where(reported >= 0, reported, vehicle.clock_domain),
        budget=config.budget,
        ionosphere=_ionosphere(options, decoded, mark),
        rules=options.rules,
        mark_clock=mark.clock,
        restarted=restarted[: vehicle.antennas],
        others=other_measurements(decoded),
    )


def _navigated(
    config: FlightConfig, nav: Any, t_ns: int, z: Ranges, inputs: FixInputs
) -> tuple[Any, Solution]:
    """The navigator's state after this epoch and its solution as it is published.

    SolutionError names the navigator if its author has made a solution wrong.
    """
    navigator = config.navigator
    try:
        nav, solution = navigator.update(navigator.predict(nav, t_ns), z, inputs)
        solution = publishable(assess(solution), len(z))
    except SolutionError as error:
        raise SolutionError(f"navigator '{config.navigator_name}': {error}") from error
    return nav, with_dilution(solution, z, inputs)


def _commanded(
    config: FlightConfig,
    mode: Mode,
    channels: ChannelManager,
    permitted: tuple[I64, I64] | None,
    m: Measurements,
    epoch: int,
) -> tuple[ChannelManager, Commands | None]:
    """The channels as the mode and the permissions of `_permissions` have them, and the commands due; those
    under way are repeated with or without new permissions."""
    if config.policy.assign is None:
        return channels, None
    if GUIDANCE[mode] is Guidance.RELEASE and channels.commanded:
        channels = channel_manager.surrendered(channels)
    elif permitted is not None:
        channels = channel_manager.planned(channels, permitted[0], m, permitted[1])
    return channel_manager.due(channels, epoch, config.options)


def _permissions(
    config: FlightConfig,
    mode: Mode,
    channels: ChannelManager,
    predictions: Predictions,
    orbit: OrbitState | None,
    attitude: Attitude | None,
    mark: Mark,
) -> tuple[I64, I64] | None:
    """Steps 6 to 9: (SATELLITES,) antenna each satellite is permitted on, -1 none, and signal that it is
    tracked by there beside its first, 0 none.

    None where the permissions stand as they are: the receivers choose, the mode assigns nothing, or there is
    no orbit or attitude.
    """
    assign = config.policy.assign
    if assign is None or GUIDANCE[mode] is not Guidance.ASSIGN or orbit is None or attitude is None:
        return None
    vehicle, options, satellites = config.vehicle, config.options, channels.satellites
    sat, pos_sv = almanac.predicted(predictions, mark.t_ns)
    los, distance = directions(pos_sv, orbit.position_m)
    visible = clear_of_earth(los, distance, orbit.position_m, options.ray_height_km * 1e3)
    visible &= predictions.healthy[sat] & (satellites.blocked_until[sat] <= mark.epoch)
    sat, los = sat[visible], los.compress(visible, axis=1)
    theta = angles_rad(los, boresights_ecef(attitude, vehicle.boresight_body))
    permitted, before = _NOWHERE.copy(), satellites.permitted[sat]
    if not options.ionosphere_free:
        permitted[sat] = assign(theta, vehicle.mask_rad, vehicle.channels, before, options)
        return permitted, channel_manager.NO_SECOND
    second = channel_manager.NO_SECOND.copy()
    signal, single = config.second[:, sat // NUMBERS], satellites.single_until[sat] > mark.epoch
    permitted[sat], second[sat] = in_pairs(
        assign, theta, vehicle.mask_rad, vehicle.channels, before, options, signal, single
    )
    return permitted, second
