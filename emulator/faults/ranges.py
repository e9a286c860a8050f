"""Ranges, rates and satellites' coordinates of whole channels: faults of the sky as receivers report them.

A shift of the range moves the code, the carrier with it where it does, and what it grows by is in the range
rate: what a receiver would measure. Channels of one epoch are put together again from their ten frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, U64, Bool
from gnss_hil.dbc.common.limits import CHANNELS, MAX_RECEIVERS
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.emulator.faults.base import Now
from gnss_hil.emulator.faults.signals import misfits, physical, with_signal
from gnss_hil.emulator.signal.bands import wavelength_m


def channel_rows(codec: Codec, frames: FrameBatch, kind: str) -> tuple[I64, I64, I64]:
    """Rows (r,) of a measurement kind in an epoch's frames, their receivers and channels."""
    layout = codec.kinds[kind]
    rows = np.flatnonzero(
        (codec.kind_of[frames.can_id & SFF_MASK] == layout.number) & (frames.can_id <= SFF_MASK)
    )
    channel = physical(layout, "channel", frames.words[rows]).astype(np.int64)
    return rows, codec.number_of[frames.can_id[rows]].astype(np.int64), channel


def scattered(codec: Codec, frames: FrameBatch, kind: str, signal: str) -> F64:
    """(receivers + 1, channels) a signal of an epoch's measurements, nan where a channel has none."""
    found = np.full((MAX_RECEIVERS + 1, CHANNELS), np.nan)
    rows, receiver, channel = channel_rows(codec, frames, kind)
    found[receiver, channel] = physical(codec.kinds[kind], signal, frames.words[rows])
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Shift:
    """Content: pseudoranges longer by step_m, and by rate_mps for each second of the window.

    carrier        phases too
    tag_ns_per_m   receivers' own time tags later by so much for each metre
    """

    codec: Codec
    step_m: float
    rate_mps: float
    carrier: bool
    tag_ns_per_m: float = 0.0

    def fresh(self, codec: Codec) -> int:
        return 0

    def clipped(self, state: int, /) -> int:
        return state

    def step(self, state: int, frames: FrameBatch, hit: Bool, now: Now) -> tuple[int, U64]:
        words = frames.words.copy()
        if not hit.any():
            return 0, words
        metres = self.step_m + self.rate_mps * now.elapsed_s
        clipped = self._add(words, frames, hit, "RANGE", "pseudorange_m", metres)
        if self.rate_mps:
            clipped += self._add(words, frames, hit, "RATE", "range_rate_mps", self.rate_mps)
        if self.carrier:
            clipped += self._add(words, frames, hit, "PHASE", "phase_cyc", metres / self._wave_m(frames))
        if self.tag_ns_per_m:
            layout = self.codec.kinds["TAG"]
            rows = np.flatnonzero(hit & (self.codec.kind_of[frames.can_id & SFF_MASK] == layout.number))
            tags = physical(layout, "tag_offset_ns", words[rows]) + metres * self.tag_ns_per_m
            words[rows] = with_signal(layout, "tag_offset_ns", words[rows], tags)
            clipped += misfits(layout, "tag_offset_ns", tags)
        return clipped, words

    def _add(self, words: U64, frames: FrameBatch, hit: Bool, kind: str, signal: str, by: Any) -> int:
        """A number, or one for each channel (receivers + 1, channels), in place; nan: nothing. How many
        sums no bits can carry."""
        rows, receiver, channel = channel_rows(self.codec, frames, kind)
        added = np.broadcast_to(by, (MAX_RECEIVERS + 1, CHANNELS))[receiver, channel]
        mine = hit[rows] & np.isfinite(added)
        rows, layout = rows[mine], self.codec.kinds[kind]
        longer = physical(layout, signal, words[rows]) + added[mine]
        words[rows] = with_signal(layout, signal, words[rows], longer)
        return misfits(layout, signal, longer)

    def _wave_m(self, frames: FrameBatch) -> F64:
        """(receivers + 1, channels) wavelength of what each channel tracks [m], nan where it is not known."""
        signal = scattered(self.codec, frames, "RATE", "signal")
        frequency = scattered(self.codec, frames, "SV_VZ", "frequency")
        found = np.full(signal.shape, np.nan)
        there = np.isfinite(signal) & np.isfinite(frequency)
        found[there] = wavelength_m(signal[there].astype(np.int64), frequency[there].astype(np.int64))
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """Content: satellites reported elsewhere: farther out by radial_m, ahead by along_m, to the left of their
    way by cross_m, and all coordinates times scale."""

    codec: Codec
    radial_m: float = 0.0
    along_m: float = 0.0
    cross_m: float = 0.0
    scale: float = 1.0

    def fresh(self, codec: Codec) -> int:
        return 0

    def clipped(self, state: int, /) -> int:
        return state

    def step(self, state: int, frames: FrameBatch, hit: Bool, now: Now) -> tuple[int, U64]:
        words, clipped = frames.words.copy(), 0
        if not hit.any():
            return clipped, words
        codec = self.codec
        pos = np.stack([scattered(codec, frames, f"SV_{a.upper()}", f"{a}_m") for a in "xyz"], axis=-1)
        vel = np.stack([scattered(codec, frames, f"SV_V{a.upper()}", f"v{a}_mps") for a in "xyz"], axis=-1)
        moved = self.scale * pos + self._offset_m(pos, vel)
        for axis, name in enumerate("xyz"):
            rows, receiver, channel = channel_rows(codec, frames, f"SV_{name.upper()}")
            to = moved[receiver, channel, axis]
            mine = hit[rows] & np.isfinite(to)
            layout = codec.kinds[f"SV_{name.upper()}"]
            words[rows[mine]] = with_signal(layout, f"{name}_m", words[rows[mine]], to[mine])
            clipped += misfits(layout, f"{name}_m", to[mine])
        return clipped, words

    def _offset_m(self, pos: F64, vel: F64) -> F64:
        if not (self.radial_m or self.along_m or self.cross_m):
            return np.zeros_like(pos)
        out = pos / np.linalg.norm(pos, axis=-1, keepdims=True)
        left = np.cross(out, vel)
        left /= np.linalg.norm(left, axis=-1, keepdims=True)
        return self.radial_m * out + self.along_m * np.cross(left, out) + self.cross_m * left
