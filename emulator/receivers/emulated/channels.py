"""Channels of a craft's receivers and what the unit knows: the state that steps from epoch to epoch.

A channel is idle, or it is set on a satellite. Set on one, it searches while there is a signal, holds it
(BIT_SYNC) while the ephemeris is being collected, and measures (FULL) once the unit knows the ephemeris.
Without a signal it goes back to search and waits there for as long as it is set.

The receivers of a craft are one unit: they share time and almanac, and every ephemeris one of them collects
unless each keeps its own. An ephemeris is the satellite's, whatever signal it was collected from. Modelled:
times of acquisition are those of the scenario, the same for all signals of a system (an ephemeris may take as
long as the frames of its message do, `gnss_hil.emulator.signal.data_frames`), a signal strong enough is found
and never lost while it stays so, a phase begins without half-cycle doubt, and a receiver runs from before the
run to its end.

Step 2 and block 1 of RU 2706636 C1: an antenna's channels track satellites inside its field of view.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I8, I64, Bool
from gnss_hil.dbc.contract.values import VALUES

LOCK = {label: raw for raw, label in VALUES["Lock"].items()}
IDLE, SEARCH, BIT_SYNC, FULL = (LOCK[label] for label in ("IDLE", "SEARCH", "BIT_SYNC", "FULL"))
SLIPS = 16
NEVER_NS = -(1 << 62)
NOTHING = -1

Collection = Callable[[I64, I64], I64]
"""Rows of the sky and times since when they are received, (m, k) [ns] -> how long their ephemerides take
[ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class Channels:
    """State of the channels (m, k): row a is receiver a + 1; receivers with fewer channels leave the last
    columns idle and commanded.

    commanded  set by command (or released by one); otherwise the channel searches by itself
    target     column of satellites and signals the channel is set on (`gnss_hil.emulator.signal.carriers`),
               -1 none
    lock       value of the contract's table "Lock"
    since_ns   GPS time since when the channel searches with a signal, or holds it
    slips      times the carrier phase was started, modulo 16
    ambiguity  whole cycles taken off the carrier phase
    arc        number of the phase arc that is being counted, `gnss_hil.emulator.environment.signals`
    turns_cyc  turns of antennas counted on in the carrier phase [cycles], nan where none are
    """

    commanded: Bool
    target: I64
    lock: I8
    since_ns: I64
    slips: I64
    ambiguity: F64
    arc: I64
    turns_cyc: F64


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """What a unit knows.

    warm          time and rough position are known: some channel has measured before
    collected_ns  (u, n) when each satellite's ephemeris was last collected, NEVER_NS if not yet; u = 1: by
                  any receiver, u = m: by each
    """

    warm: bool
    collected_ns: I64


@dataclass(frozen=True, slots=True)
class Pace:
    """Times of acquisition [ns]: to find a signal knowing time, almanac and ephemeris (hot), all but the
    ephemeris (warm), nothing (cold); to collect an ephemeris; how long one serves."""

    hot_ns: int
    warm_ns: int
    cold_ns: int
    ephemeris_ns: int
    ephemeris_age_ns: int


def fresh_channels(counts: I64) -> Channels:
    """All channels idle and searching by themselves; counts (m,) channels of each receiver."""
    shape = len(counts), int(counts.max())
    exists = np.arange(shape[1]) < counts[:, None]
    return Channels(
        ~exists,
        np.full(shape, NOTHING),
        np.full(shape, IDLE, np.int8),
        np.zeros(shape, np.int64),
        np.zeros(shape, np.int64),
        np.zeros(shape),
        np.zeros(shape, np.int64),
        np.full(shape, np.nan),
    )


def fresh_knowledge(satellites: int, holders: int = 1) -> Knowledge:
    """A cold unit: nothing known but which satellites there are.

    holders  1: the receivers share ephemerides; as many as receivers: they do not
    """
    return Knowledge(False, np.full((holders, satellites), NEVER_NS))


def retarget(channels: Channels, commanded: Bool, target: I64, t_ns: int) -> Channels:
    """Channels set anew; one whose satellite stays keeps its lock."""
    if np.array_equal(target, channels.target):
        return replace(channels, commanded=commanded)
    moved = target != channels.target
    lock = np.where(moved, np.where(target < 0, IDLE, SEARCH), channels.lock).astype(np.int8)
    since_ns = np.where(moved, t_ns, channels.since_ns)
    return replace(channels, commanded=commanded, target=target, lock=lock, since_ns=since_ns)


def receivable(channels: Channels, signal: Bool, held: Bool | None) -> Bool:
    """(m, c) signals at antennas: strong enough to be found, or, where a channel has it, to be held
    (None: what is found is held)."""
    if held is None:
        return signal
    receiver, channel = np.nonzero(channels.lock >= BIT_SYNC)
    column = channels.target[receiver, channel]
    out = signal.copy()
    out[receiver, column] = held[receiver, column]
    return out


def advance(
    channels: Channels,
    knowledge: Knowledge,
    signal: Bool,
    pace: Pace,
    t_ns: int,
    collection_ns: Collection | None = None,
) -> tuple[Channels, Knowledge, Bool]:
    """Search, hold and measure for one epoch: step 2 of RU 2706636 C1, block 1 at work.

    signal   (m, c) whether a satellite's signal is strong enough at an antenna
    collection_ns   how long an ephemeris takes to be collected, None: as `pace` has it
    returns  channels and knowledge at t_ns, and (m, k) where measuring begins in this epoch
    """
    target, lock, since_ns = channels.target, channels.lock, channels.since_ns
    tuned = target >= 0
    receives = signal[np.arange(len(signal))[:, None], target] & tuned
    lost = tuned & ~receives
    n = knowledge.collected_ns.shape[1]
    row = target if signal.shape[1] == n else target % n
    if not lost.any() and ((lock == FULL) == tuned).all():
        return channels, _collect(knowledge, row, tuned, t_ns), np.zeros_like(lost)
    known = _fresh(knowledge, pace, row, t_ns)
    since_ns = np.where(lost, t_ns, since_ns)
    lock = np.where(lost, SEARCH, lock)
    to_find_ns = np.where(known, pace.hot_ns, pace.warm_ns) if knowledge.warm else pace.cold_ns
    held_ns = t_ns - since_ns
    found = receives & (lock == SEARCH) & (held_ns >= to_find_ns)
    since_ns = np.where(found, t_ns, since_ns)
    held_ns = t_ns - since_ns
    lock = np.where(found, BIT_SYNC, lock)
    collects = receives & (lock == BIT_SYNC)
    begins = collects & known
    if (collects & ~known).any():
        to_collect_ns = pace.ephemeris_ns if collection_ns is None else collection_ns(row, since_ns)
        begins |= collects & (held_ns >= to_collect_ns)
    lock = np.where(begins, FULL, lock).astype(np.int8)
    slips = (channels.slips + begins) % SLIPS
    return (
        replace(channels, lock=lock, since_ns=since_ns, slips=slips),
        _collect(knowledge, row, lock == FULL, t_ns),
        begins,
    )


def _holder(knowledge: Knowledge, receivers: int) -> I64:
    """(m, 1) row of collected_ns that each receiver knows of."""
    return np.minimum(np.arange(receivers), len(knowledge.collected_ns) - 1)[:, None]


def _fresh(knowledge: Knowledge, pace: Pace, row: I64, t_ns: int) -> Bool:
    """(m, k) whether receivers have ephemerides that still serve of channels' satellites, rows of the sky."""
    serves = t_ns - knowledge.collected_ns <= pace.ephemeris_age_ns
    return serves[_holder(knowledge, len(row)), row]


def _collect(knowledge: Knowledge, row: I64, measures: Bool, t_ns: int) -> Knowledge:
    """A satellite that is measured sends its ephemeris over and over: knowledge of it stays new."""
    collected_ns = knowledge.collected_ns.copy()
    holder = np.broadcast_to(_holder(knowledge, len(row)), row.shape)
    collected_ns[holder[measures], row[measures]] = t_ns
    return Knowledge(knowledge.warm or bool(measures.any()), collected_ns)
