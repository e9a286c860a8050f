"""Modes of the flight software: a table of transitions, and what each mode does with the receivers.

Every call of the flight step is an epoch, also one whose time mark was lost: the bus hands over whole blocks
only, never an empty poll. An epoch without a mark has no fix and counts as one without. Nothing can be
commanded in it, because commands bear the mark's epoch number: what the mode has come to meanwhile, a
surrender above all, is commanded with the next mark, unless that epoch brings a fix.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Annotated

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.io.encode import NodeState
from gnss_hil.flightsw.records.solution import NoFix, Solution


class ModeOptions(Strict):
    autonomy_after_epochs: Annotated[
        int,
        Field(ge=1, le=86400, description="without a fix for so long, receivers search by themselves again"),
    ] = 120


class Mode(Enum):
    STANDBY = "no time mark yet"
    START = "no fix yet; receivers search by themselves"
    NAVIGATING = "a fix in this epoch"
    COASTING = "no fix, the position is propagated, or stands where there is no time"
    LOST = "no fix, and no position to propagate; receivers go on as commanded"
    SURRENDERED = "too long without a fix; receivers search by themselves again"


class Event(Enum):
    NO_TIME = "an epoch without a time mark: nothing in it is used, the last position stands"
    FIX = "a fix"
    PROPAGATED = "no fix, but a position"
    NO_POSITION = "neither fix nor position"
    OVERDUE = "no fix for `autonomy_after_epochs`"


class Guidance(Enum):
    """What a mode does with the receivers' channels."""

    KEEP = "what was commanded stands"
    ASSIGN = "satellites are assigned by the policy"
    RELEASE = "channels are set free"


GUIDANCE: Mapping[Mode, Guidance] = {
    Mode.STANDBY: Guidance.KEEP,
    Mode.START: Guidance.KEEP,
    Mode.NAVIGATING: Guidance.ASSIGN,
    Mode.COASTING: Guidance.ASSIGN,
    Mode.LOST: Guidance.KEEP,
    Mode.SURRENDERED: Guidance.RELEASE,
}

NODE_STATE: Mapping[Mode, NodeState] = {
    Mode.STANDBY: NodeState.READY,
    Mode.START: NodeState.DEGRADED,
    Mode.NAVIGATING: NodeState.RUNNING,
    Mode.COASTING: NodeState.DEGRADED,
    Mode.LOST: NodeState.DEGRADED,
    Mode.SURRENDERED: NodeState.DEGRADED,
}
"""What the heartbeat reports of a mode. The contract has one word for all that is less than a fix."""

RAW_MODE: Mapping[Mode, int] = {mode: raw_of("FlightMode")[mode.name] for mode in Mode}
"""As in the contract's value table."""

TRANSITIONS: Mapping[Mode, Mapping[Event, Mode]] = {
    Mode.STANDBY: {
        Event.NO_TIME: Mode.STANDBY,
        Event.FIX: Mode.NAVIGATING,
        Event.PROPAGATED: Mode.START,
        Event.NO_POSITION: Mode.START,
        Event.OVERDUE: Mode.START,
    },
    Mode.START: {
        Event.NO_TIME: Mode.START,
        Event.FIX: Mode.NAVIGATING,
        Event.PROPAGATED: Mode.START,
        Event.NO_POSITION: Mode.START,
        Event.OVERDUE: Mode.START,
    },
    Mode.NAVIGATING: {
        Event.NO_TIME: Mode.COASTING,
        Event.FIX: Mode.NAVIGATING,
        Event.PROPAGATED: Mode.COASTING,
        Event.NO_POSITION: Mode.LOST,
        Event.OVERDUE: Mode.SURRENDERED,
    },
    Mode.COASTING: {
        Event.NO_TIME: Mode.COASTING,
        Event.FIX: Mode.NAVIGATING,
        Event.PROPAGATED: Mode.COASTING,
        Event.NO_POSITION: Mode.LOST,
        Event.OVERDUE: Mode.SURRENDERED,
    },
    Mode.LOST: {
        Event.NO_TIME: Mode.LOST,
        Event.FIX: Mode.NAVIGATING,
        Event.PROPAGATED: Mode.COASTING,
        Event.NO_POSITION: Mode.LOST,
        Event.OVERDUE: Mode.SURRENDERED,
    },
    Mode.SURRENDERED: {
        Event.NO_TIME: Mode.SURRENDERED,
        Event.FIX: Mode.NAVIGATING,
        Event.PROPAGATED: Mode.SURRENDERED,
        Event.NO_POSITION: Mode.SURRENDERED,
        Event.OVERDUE: Mode.SURRENDERED,
    },
}


def event_of(solution: Solution, epochs_without_fix: int, options: ModeOptions) -> Event:
    """What an epoch brought; epochs_without_fix counts it too, from the first time mark on."""
    if solution.fix is not None:
        return Event.FIX
    if epochs_without_fix >= options.autonomy_after_epochs:
        return Event.OVERDUE
    if solution.reason is NoFix.NO_TIME_MARK:
        return Event.NO_TIME
    return Event.NO_POSITION if solution.orbit is None else Event.PROPAGATED


def decide(mode: Mode, event: Event) -> Mode:
    """The next mode."""
    return TRANSITIONS[mode][event]
