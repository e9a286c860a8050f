"""The state machine that AUTOSAR keeps for each protected stream: from checks of single frames to whether the
stream can be trusted. All streams at once.

Source: AUTOSAR PRS E2E Protocol and SWS E2E Library, release 4.3.0: E2E_SMCheck, one window for all states.
Of the last WindowSize statuses E2E_P_OK and E2E_P_ERROR count; REPEATED, WRONGSEQUENCE and NONEWDATA are
neither, but push older ones out:

    NODATA    -> INIT     on any status but ERROR and NONEWDATA; the window begins empty with the next one
    INIT      -> VALID    errors <= MaxErrorStateInit and oks >= MinOkStateInit
              -> INVALID  errors >  MaxErrorStateInit
    VALID     -> INVALID  errors >  MaxErrorStateValid or oks < MinOkStateValid
    INVALID   -> VALID    errors <= MaxErrorStateInvalid and oks >= MinOkStateInvalid
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import U8, U64, Bool, Index
from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.contract.screening import Verdict


class Status(IntEnum):
    """Of a stream in one check; AUTOSAR's numbers of E2E_PCheckStatusType. NOT_AVAILABLE: not checked."""

    OK = 0
    REPEATED = 1
    WRONG_SEQUENCE = 2
    ERROR = 3
    NOT_AVAILABLE = 4
    NO_NEW_DATA = 5


class State(IntEnum):
    """Of a stream; AUTOSAR's numbers of E2E_SMStateType, without the one of no initialisation."""

    VALID = 0
    NODATA = 2
    INIT = 3
    INVALID = 4


STATUS_OF: dict[Verdict, Status] = {
    Verdict.OK: Status.OK,
    Verdict.LOST: Status.OK,
    Verdict.REPEATED: Status.REPEATED,
    Verdict.WRONG_SEQUENCE: Status.WRONG_SEQUENCE,
    Verdict.CORRUPTED: Status.ERROR,
    Verdict.MIXED_EPOCH: Status.WRONG_SEQUENCE,
}
"""As the profile's own statuses are mapped (OKSOMELOST is OK); a frame of another epoch is out of sequence.
Frames of other verdicts have no stream."""


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Windows and limits by state, (5,) each.

    window         bits of the window: none in NODATA, which keeps no statuses
    min_ok, max_error   of the window
    usable         whether frames of a stream in that state are used
    """

    window: U64
    min_ok: U8
    max_error: U8
    usable: Bool


def limits(protection: Protection) -> Limits:
    p, states = protection, max(State) + 1
    window = np.full(states, (1 << p.window_size) - 1, np.uint64)
    window[State.NODATA] = 0
    min_ok, max_error, usable = np.zeros(states, np.uint8), np.zeros(states, np.uint8), np.zeros(states, bool)
    min_ok[State.INIT], max_error[State.INIT] = p.min_ok_state_init, p.max_error_state_init
    min_ok[State.VALID], max_error[State.VALID] = p.min_ok_state_valid, p.max_error_state_valid
    min_ok[State.INVALID], max_error[State.INVALID] = p.min_ok_state_invalid, p.max_error_state_invalid
    usable[State.VALID], usable[State.INIT] = True, p.use_state_init
    return Limits(window, min_ok, max_error, usable)


@dataclass(frozen=True, slots=True, eq=False)
class StreamStates:
    """Of streams (n,).

    state       State
    ok, error   the window: bit k is set where the status was that, k checks ago
    """

    state: U8
    ok: U64
    error: U64


def no_data(streams: int) -> StreamStates:
    """Nothing received yet."""
    return StreamStates(
        np.full(streams, State.NODATA, np.uint8), np.zeros(streams, np.uint64), np.zeros(streams, np.uint64)
    )


_STATUSES = max(Status) + 1


def _next_states() -> U8:
    """The next state by state, status, whether oks are enough and whether errors are few enough, flat."""
    found = np.empty((max(State) + 1, _STATUSES, 2, 2), np.uint8)
    found[:] = np.arange(len(found), dtype=np.uint8)[:, None, None, None]
    for status in set(Status) - {Status.ERROR, Status.NO_NEW_DATA, Status.NOT_AVAILABLE}:
        found[State.NODATA, status] = State.INIT
    for status in set(Status) - {Status.NOT_AVAILABLE}:
        found[State.INIT, status, :, 0] = State.INVALID
        found[State.INIT, status, 1, 1] = State.VALID
        found[State.VALID, status] = State.INVALID
        found[State.VALID, status, 1, 1] = State.VALID
        found[State.INVALID, status, 1, 1] = State.VALID
    return found.ravel()


_NEXT = _next_states()
_OK = np.array([status == Status.OK for status in range(_STATUSES)], np.uint64)
_ERROR = np.array([status == Status.ERROR for status in range(_STATUSES)], np.uint64)
_ONE = np.uint64(1)
_NOT_AVAILABLE = np.uint8(Status.NOT_AVAILABLE)
_BY_STATE, _BY_STATUS, _BY_ENOUGH = (np.uint8(4 * _STATUSES), np.uint8(4), np.uint8(2))


def advance(limits: Limits, states: StreamStates, status: U8) -> StreamStates:
    """States after one check of streams, of status (n,); NOT_AVAILABLE leaves a stream as it is. The states
    themselves if nothing changes."""
    rows = (status != _NOT_AVAILABLE).nonzero()[0]
    state, status = states.state.take(rows), status.take(rows)
    before_ok, before_error = states.ok.take(rows), states.error.take(rows)
    window = limits.window.take(state)
    ok = (before_ok << _ONE | _OK.take(status)) & window
    error = (before_error << _ONE | _ERROR.take(status)) & window
    enough = np.bitwise_count(ok) >= limits.min_ok.take(state)
    few = np.bitwise_count(error) <= limits.max_error.take(state)
    row = state * _BY_STATE + status * _BY_STATUS + enough * _BY_ENOUGH + few
    after = _NEXT.take(row)
    if (after == state).all() and (ok == before_ok).all() and (error == before_error).all():
        return states
    return StreamStates(
        _put(states.state, rows, after), _put(states.ok, rows, ok), _put(states.error, rows, error)
    )


def _put(into: NDArray, rows: Index, values: NDArray) -> NDArray:
    """A copy with these values in some rows."""
    copy = into.copy()
    copy[rows] = values
    return copy
