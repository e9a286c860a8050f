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

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.app import modes
from gnss_hil.flightsw.app.admission import counted, received_block, refused_reports, timed
from gnss_hil.flightsw.app.answer import answer
from gnss_hil.flightsw.app.commanding import commanded, permissions
from gnss_hil.flightsw.app.config import FlightConfig
from gnss_hil.flightsw.app.navigation import fix_inputs, navigated, ranges_of
from gnss_hil.flightsw.app.state import FlightState
from gnss_hil.flightsw.attitude.attitude import attitude_now
from gnss_hil.flightsw.estimation.prior import LEAST_TRUSTED_S
from gnss_hil.flightsw.integrity import satellite_reports
from gnss_hil.flightsw.integrity.time_marks import TimeMarks
from gnss_hil.flightsw.io.frame_statistics import Reason
from gnss_hil.flightsw.io.reception import Reception
from gnss_hil.flightsw.measurement.observables import of_one_signal
from gnss_hil.flightsw.measurement.space import predicted
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.receivers import channel_manager
from gnss_hil.flightsw.records.epoch import Epoch
from gnss_hil.flightsw.records.solution import NoFix

FULL_LOCK = raw_of("Lock")["FULL"]
"""Only with frame synchronisation is a pseudorange free of the code's ambiguity."""


def flight_step(
    config: FlightConfig, state: FlightState, inbox: FrameBatch
) -> tuple[FlightState, FrameBatch]:
    """The block of frames that answers a block of frames. Never raises on what a bus may carry."""
    state, received, rejected, decoded = received_block(config, state, inbox)
    reports = satellite_reports.judged(state.predictions, decoded, state.solution.orbit)
    marks, decoded, rejected = timed(config, state, decoded, reports, rejected)
    if decoded.mark is None:
        return _timeless(config, state, decoded, marks, received, rejected)
    mark, options = decoded.mark, config.options
    m, t_ns = decoded.measurements, decoded.mark.t_ns
    attitude = attitude_now(decoded.attitude, state.attitude, t_ns, options.attitude_hold_epochs)
    if decoded.attitude is not None and attitude is not None and attitude.age:
        rejected = counted(rejected, Reason.TURNED, config.codec.can_id_of["ATT_Q01", 0])
    channels = channel_manager.acknowledged(state.channels, decoded.acks, mark.epoch, options)
    restarted = channel_manager.restarted(channels, decoded.boots)
    channels = channel_manager.contradicted(channels, m, decoded.boots)

    rejected = refused_reports(config, rejected, m, reports)
    sound = reports.sound & (m.lock == FULL_LOCK) & predicted(m.ura)
    predictions = almanac.updated(
        state.predictions, reports.almanac, m.where(sound), t_ns, reports.sent_ns[sound]
    )
    offered = m.where(sound & (m.health == 0) & channel_manager.usable(channels, m))
    delays, z = ranges_of(offered, config, state.ionosphere_delays, t_ns)
    inputs = fix_inputs(config, decoded, mark, marks.doubt_s, attitude, restarted)

    nav, solution = navigated(config, state.nav, t_ns, z, inputs)
    single = False
    if options.ionosphere_free and solution.fix is None and options.without_pairs == "one-signal":
        z, single = of_one_signal(offered, config.budget), True
        nav, solution = navigated(config, state.nav, t_ns, z, inputs)
    if solution.fix is not None:
        in_fix = z.sat[solution.fix.used]
        if solution.orbit is not None and solution.orbit.trusted_s > LEAST_TRUSTED_S:
            predictions = almanac.proven(predictions, in_fix, t_ns)
        if channels.commanded:
            channels = channel_manager.used(channels, in_fix, mark.epoch)

    without_fix = 0 if solution.fix is not None else state.without_fix + 1
    mode = modes.decide(state.mode, modes.event_of(solution, without_fix, options))
    permitted = permissions(config, mode, channels, predictions, solution.orbit, attitude, mark)
    channels, commands = commanded(config, mode, channels, permitted, m, mark.epoch)
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
        ionosphere_delays=delays,
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
