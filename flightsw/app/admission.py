"""What of a block an epoch goes on with: sessions, time marks, reports; what is refused is counted."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.flightsw.app.config import FlightConfig
from gnss_hil.flightsw.app.state import FlightState, initial_state
from gnss_hil.flightsw.integrity import time_marks
from gnss_hil.flightsw.integrity.satellite_reports import Reports
from gnss_hil.flightsw.integrity.time_marks import TimeMarks
from gnss_hil.flightsw.io import decode, rival_marks
from gnss_hil.flightsw.io.frame_statistics import Reason, Rejections
from gnss_hil.flightsw.io.reception import Reception
from gnss_hil.flightsw.records.epoch import Epoch, Measurements, empty_epoch

_ONE = np.ones(1, bool)


def timed(
    config: FlightConfig, state: FlightState, decoded: Epoch, reports: Reports, rejected: I64
) -> tuple[TimeMarks, Epoch, I64]:
    """The marks after this one, the epoch, which is empty if its mark is not believed, and counts."""
    if decoded.mark is None:
        return state.marks, decoded, rejected
    marks, believed = time_marks.advanced(state.marks, decoded.mark, reports.agree)
    if believed:
        return marks, decoded, rejected
    rejected = counted(rejected, Reason.JUMPED, config.codec.can_id_of["TIME_MARK", 0])
    return marks, empty_epoch(decoded.lost), rejected


def counted(rejected: I64, reason: Reason, can_id: int) -> I64:
    """Counts with one more."""
    counts = Rejections(rejected)
    counts.add(reason, np.array([can_id]), _ONE)
    return counts.counts


def refused_reports(config: FlightConfig, rejected: I64, m: Measurements, reports: Reports) -> I64:
    """Counts after channels whose reports are not believed, at the frame that closes a channel."""
    if reports.sound.all():
        return rejected
    counts = Rejections(rejected)
    closing = config.codec.can_id_of["SV_CLOCK", 1] + 0x10 * m.receiver
    counts.add(Reason.NO_ORBIT, closing, ~reports.in_orbit)
    counts.add(Reason.MOVED, closing, reports.in_orbit & reports.moved)
    return counts.counts


def received_block(
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
    rivals = rival_marks.rivals(
        config.codec, inbox, state.received.counters, partial(time_marks.follows, state.marks)
    )
    if rivals is not None:
        counts = Rejections(rejected)
        counts.add(rivals.reason, inbox.can_id[rivals.rows], np.ones(len(rivals.rows), bool))
        inbox, rejected = inbox[np.delete(np.arange(len(inbox)), rivals.rows)], counts.counts
    decoded, received, rejected = decode.decode(config.codec, config.limits, inbox, state.received, rejected)
    return state, received, rejected, decoded
