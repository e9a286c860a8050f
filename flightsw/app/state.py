"""All that one epoch hands to the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gnss_hil.dbc.common.arrays import I8, I64
from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.flightsw.app.config import FlightConfig
from gnss_hil.flightsw.app.modes import Mode
from gnss_hil.flightsw.attitude.attitude import Attitude
from gnss_hil.flightsw.integrity.time_marks import TimeMarks
from gnss_hil.flightsw.io import encode
from gnss_hil.flightsw.io.frame_statistics import no_rejections
from gnss_hil.flightsw.io.reception import Reception, nothing_received
from gnss_hil.flightsw.measurement.ionosphere_filter import IonosphereDelays, nothing_known
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.receivers import channel_manager
from gnss_hil.flightsw.receivers.channel_manager import ChannelManager
from gnss_hil.flightsw.records.epoch import Mark
from gnss_hil.flightsw.records.solution import NoFix, Solution


@dataclass(frozen=True, slots=True, eq=False)
class FlightState:
    """mode           of the last epoch
    mark           the last time mark, None before the first
    received       counters of the protection, and states of its streams
    sent           counters of the protection
    rejected       (REASONS, identifiers) frames not used; `gnss_hil.flightsw.io.frame_statistics` explains
    lost           frames missing by the counters
    attitude       None if there is none
    nav            the navigator's own state
    solution       of this epoch
    predictions    where satellites are
    channels       what the receivers were commanded and acknowledged
    without_fix    epochs since the last fix, or since the first time mark; those without a mark count
    ionosphere_delays  of the satellites, where they are followed
    marks          which time marks were believed
    single_fixes   fixes by one signal of each satellite where pairs were wanted and too few
    """

    mode: Mode
    mark: Mark | None
    received: Reception
    sent: I8
    rejected: I64
    lost: int
    attitude: Attitude | None
    nav: Any
    solution: Solution
    predictions: almanac.Predictions
    channels: ChannelManager
    without_fix: int
    single_fixes: int
    ionosphere_delays: IonosphereDelays
    marks: TimeMarks


def heartbeat(config: FlightConfig) -> FrameBatch:
    """The heartbeat before the first epoch: counter 0, always the same."""
    return _first_heartbeat(config)[0]


def initial_state(config: FlightConfig) -> FlightState:
    """Nothing received yet; the heartbeat of the start barrier has been sent."""
    return FlightState(
        mode=Mode.STANDBY,
        mark=None,
        received=nothing_received(config.codec),
        sent=_first_heartbeat(config)[1],
        rejected=no_rejections(),
        lost=0,
        attitude=None,
        nav=config.navigator.initial(),
        solution=Solution(NoFix.NO_TIME_MARK),
        predictions=almanac.no_predictions(),
        channels=channel_manager.autonomous(config.vehicle.channels, MAX_RECEIVERS),
        without_fix=0,
        single_fixes=0,
        ionosphere_delays=nothing_known(),
        marks=TimeMarks(),
    )


def _first_heartbeat(config: FlightConfig) -> tuple[FrameBatch, I8]:
    """The frame, and the counters after it."""
    frames = encode.heartbeat(config.codec, encode.NodeState.READY, config.boot_count, 0)
    return e2e.protect(config.codec, frames, e2e.fresh_counters(config.codec), 0)
