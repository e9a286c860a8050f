"""The answer of an epoch as frames: solution, commands, how the flight software flies and what it refused."""

from __future__ import annotations

from dataclasses import replace

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.flightsw.app.config import FlightConfig
from gnss_hil.flightsw.app.modes import NODE_STATE, RAW_MODE
from gnss_hil.flightsw.app.state import FlightState
from gnss_hil.flightsw.io import encode
from gnss_hil.flightsw.io.encode import Standing
from gnss_hil.flightsw.io.frame_statistics import Reason
from gnss_hil.flightsw.records.commands import Commands
from gnss_hil.flightsw.records.epoch import Mark
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import NoFix


def answer(
    config: FlightConfig,
    before: FlightState,
    after: FlightState,
    z: Ranges | None,
    commands: Commands | None,
    mark: Mark | None,
) -> tuple[FlightState, FrameBatch]:
    """The state with its counters after this epoch's answer, and that, protected.

    mark   of this epoch, or the last one
    """
    t_ns, number = (mark.t_ns, mark.epoch) if mark is not None else (0, 0)
    refused = None if after.rejected is before.rejected else after.rejected - before.rejected
    frames = encode.encode(
        config.codec,
        config.boot_count,
        z,
        after.solution,
        commands,
        NODE_STATE[after.mode],
        _standing(config, after, refused),
        refused if refused is not None and refused.any() else None,
        t_ns,
    )
    frames, sent = e2e.protect(config.codec, frames, before.sent, number)
    return replace(after, sent=sent), frames


def _standing(config: FlightConfig, state: FlightState, refused: I64 | None) -> Standing:
    attitude, silent = state.attitude, 0
    if refused is not None:
        first = config.codec.can_id_of["HEARTBEAT", 1]
        missed = refused[Reason.TIMED_OUT, first : first + config.codec.receivers]
        silent = sum(1 << int(number) for number in missed.nonzero()[0])
    return Standing(
        mode=RAW_MODE[state.mode],
        without_time=state.solution.reason is NoFix.NO_TIME_MARK,
        without_attitude=attitude is None,
        attitude_held=attitude is not None and attitude.age > 0,
        unheeded=state.channels.channels.unheeded,
        silent_receivers=silent,
        without_fix=state.without_fix,
    )
