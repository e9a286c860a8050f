"""Carrier phases of channels: ambiguities taken off, slips counted, turns of antennas counted on.

All of it is of a channel, from its phase's start on: turns known but for whole cycles are counted on from
epoch to epoch, a slip stays. After half a cycle the data are upside down, which the next subframe or string
shows by its preamble: the receiver then turns its phase by the other half, and counts that too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.receivers.emulated.channels import SLIPS, Channels
from gnss_hil.emulator.signal.phase_windup import unwrapped

PHASE_LIMIT_CYC = 1.3e8
"""Where the carrier phase is restarted: its signal on the bus ends at 1.37e8 cycles."""


@dataclass(frozen=True, slots=True, eq=False)
class Phases:
    """What loops meet in an epoch, (p,) each: see `gnss_hil.emulator.environment.signals.Signals`."""

    cycles: F64
    turns_cyc: F64 | None
    arc: I64
    half_cycles: I64 | None
    preamble: Bool | None


def track(channels: Channels, begins: Bool, place: tuple[I64, I64], met: Phases) -> tuple[F64, F64, Channels]:
    """Carrier phases (p,) [cycles] less ambiguities, the ambiguities (p,), and channels that remember.

    begins   (m, k) channels whose phase starts now
    place    receiver and channel (p,) that measure
    """
    cycles = met.cycles
    if met.turns_cyc is not None:
        turns, channels = _count_turns(channels, begins, place, met.turns_cyc)
        cycles = cycles + turns
    if met.half_cycles is not None and met.preamble is not None:
        channels = _slip(channels, begins, place, met.half_cycles, met.preamble)
    ambiguity = channels.ambiguity[place]
    breaks = np.abs(cycles - ambiguity) > PHASE_LIMIT_CYC
    breaks |= met.arc != channels.arc[place]
    starts = begins[place]
    if starts.any() or breaks.any():
        starts, slipped = starts | breaks, breaks & ~starts
        ambiguity = np.where(starts, np.floor(cycles), ambiguity)
        channels = replace(
            channels,
            ambiguity=_set(channels.ambiguity, place, ambiguity),
            slips=_set(channels.slips, place, (channels.slips[place] + slipped) % SLIPS),
            arc=_set(channels.arc, place, met.arc),
        )
    return cycles - ambiguity, ambiguity, channels


def _set(table, place: tuple[I64, I64], values):
    out = table.copy()
    out[place] = values
    return out


def _count_turns(
    channels: Channels, begins: Bool, place: tuple[I64, I64], turns_cyc: F64
) -> tuple[F64, Channels]:
    before = np.where(begins, np.nan, channels.turns_cyc)[place]
    now = unwrapped(turns_cyc, before)
    return now, replace(channels, turns_cyc=_set(np.full_like(channels.turns_cyc, np.nan), place, now))


def _slip(
    channels: Channels, begins: Bool, place: tuple[I64, I64], half_cycles: I64, preamble: Bool
) -> Channels:
    """Channels whose phases have slipped in this epoch: counted, and off from now on. One that begins has
    nothing to slip from."""
    goes_on, before = ~begins[place], channels.ambiguity[place]
    whole = np.where(preamble, np.floor(before), before)
    moved = goes_on & ((whole != before) | (half_cycles != 0))
    if not moved.any():
        return channels
    return replace(
        channels,
        ambiguity=_set(channels.ambiguity, place, np.where(moved, whole - half_cycles / 2, before)),
        slips=_set(channels.slips, place, (channels.slips[place] + moved) % SLIPS),
    )
