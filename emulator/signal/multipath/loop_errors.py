"""Multipath in a channel: what its code and carrier loops settle at when reflections arrive with the signal.

Early, prompt and late correlators, `spacing` chips from early to late, see the sum of all rays. The code loop
settles where its discriminator crosses zero upwards:

    coherent   Re[(E - L) conj(P)]: the carrier loop is locked to the prompt sum; also a dot product's zeros
    power      |E|^2 - |L|^2

Loops settle at once: an epoch is longer than they remember (modelled). Of several places to settle at they
take the one of the strongest prompt sum, so a reflection stays in lock when the direct ray is hidden.
Sources: van Nee, "Spread-spectrum code and carrier synchronization errors caused by multipath and
interference", IEEE Trans. AES 29 (1993) 1359; Braasch in Global Positioning System: Theory and Applications I
(1996), ch. 14; Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 9.5
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gnss_hil.dbc.common.arrays import C128, F64, I64
from gnss_hil.emulator.signal.correlation import Correlation, triangle

Discriminator = Literal["coherent", "power"]

_GRID_CHIPS = 0.125
_STEPS = 60
TOLERANCE_CHIPS = 1e-8
"""3 micrometres of C/A code."""


@dataclass(frozen=True, slots=True, eq=False)
class Sum:
    """The rays of p channels: delay_chips (p, k) beyond the direct one, amplitude (p, k) complex. The first
    column is the direct ray. Amplitude 0 stands for no ray."""

    delay_chips: F64
    amplitude: C128

    def at(self, correlate: Correlation, offset_chips: F64) -> C128:
        """Outputs (p, c) of correlators whose replicas are offset_chips (p, c) behind the direct ray."""
        weight = correlate(offset_chips[:, :, None] - self.delay_chips[:, None])
        parts = np.ascontiguousarray(self.amplitude).view(np.float64).reshape(*self.amplitude.shape, 2)
        return (weight @ parts).view(np.complex128)[..., 0]

    def __getitem__(self, channels) -> Sum:
        return Sum(self.delay_chips[channels], self.amplitude[channels])


@dataclass(frozen=True, slots=True, eq=False)
class Lock:
    """Where loops have settled, (p,) each.

    code_chips   pseudorange error [chips]
    lag_rad      carrier phase behind the direct ray's, counted on through whole turns of the strongest ray
    level        amplitude of the prompt sum relative to the direct ray alone, unobstructed; 0 without signal
    """

    code_chips: F64
    lag_rad: F64
    level: F64


@dataclass(frozen=True, slots=True)
class CodeLoop:
    """How a code loop sees its signal: its discriminator, its correlators from early to late [chips], and the
    correlation function of code and front end."""

    discriminator: Discriminator
    spacing_chips: float
    correlate: Correlation = triangle


def rays(direct: F64, delay_m: F64, coefficient: C128, wave_m: F64, chip_m: F64) -> Sum:
    """The rays of p channels from the direct one and k reflections each.

    direct               (p,) amplitude of the direct ray relative to an unobstructed one, 0 when hidden
    delay_m              (p, k);  coefficient (p, k) complex, without the phase of the delay; 0 for none
    wave_m, chip_m       (p,) lengths of carrier wave and code chip
    """
    turned = coefficient * np.exp(-2j * np.pi * delay_m / wave_m[:, None])
    zero = np.zeros((len(direct), 1))
    return Sum(
        np.hstack((zero, delay_m / chip_m[:, None])), np.hstack((direct[:, None].astype(complex), turned))
    )


def discriminator(kind: Discriminator, early: C128, prompt: C128, late: C128) -> F64:
    """Discriminators (...) of correlator outputs (...)."""
    return ((early - late) * (prompt if kind == "coherent" else early + late).conj()).real


def settle(loop: CodeLoop, total: Sum) -> tuple[F64, C128]:
    """Code errors (p,) [chips] where loops settle, and their prompt outputs (p,); both 0 without any ray."""
    code_chips, prompt = np.zeros(len(total.delay_chips)), total.amplitude[:, 0].copy()
    disturbed = np.flatnonzero(total.amplitude[:, 1:].any(axis=1))
    if len(disturbed):
        busy = total[disturbed]
        code_chips[disturbed] = _zero(loop, busy)
        prompt[disturbed] = busy.at(loop.correlate, code_chips[disturbed, None])[:, 0]
    return code_chips, prompt


def _zero(loop: CodeLoop, total: Sum) -> F64:
    """Upward zeros (p,) [chips] of the discriminators of channels with rays, the strongest of each.

    A grid over all delays at which a replica meets a ray gives brackets, the Illinois form of false position
    the zero, to TOLERANCE_CHIPS. A channel's answer does not depend on the others.
    Source: Dowell & Jarratt, BIT 11 (1971) 168
    """
    apart = int(np.ceil(loop.spacing_chips / 2 / _GRID_CHIPS))
    step = loop.spacing_chips / 2 / apart
    ends = np.ceil(total.delay_chips.max(axis=1)) + 1 + 2 * (apart + 1) * step
    grid = np.arange(-1 - 2 * apart * step, ends.max(), step)
    seen = total.at(loop.correlate, np.broadcast_to(grid, (len(total.delay_chips), len(grid))))
    prompt = seen[:, apart:-apart]
    value = discriminator(loop.discriminator, seen[:, : -2 * apart], prompt, seen[:, 2 * apart :])
    rises = (value[:, :-1] <= 0) & (value[:, 1:] > 0) & (grid[2 * apart + 1 :] < ends[:, None])
    strength = np.maximum(np.abs(prompt[:, :-1]), np.abs(prompt[:, 1:]))
    best = np.where(rises, strength, -1.0).argmax(axis=1)
    channel = np.arange(len(best))
    low, high = grid[apart + best], grid[apart + best + 1]
    # Rays that cancel everywhere leave no place to settle at: the loop stays at the grid's empty end.
    lost = ~rises.any(axis=1)
    below = np.where(lost, -1.0, value[channel, best])
    above = np.where(lost, 1.0, value[channel, best + 1])
    return _false_position(loop, total, (low, high, below, above))


def _false_position(loop: CodeLoop, total: Sum, bracket: tuple[F64, F64, F64, F64]) -> F64:
    """Zeros (p,) [chips] between low and high, where discriminators are below and above zero."""
    low, high, below, above = bracket
    shift = loop.spacing_chips / 2 * np.array((-1.0, 0.0, 1.0))
    found = np.empty(len(low))
    moving, middle, stale = np.arange(len(low)), np.full(len(low), np.inf), np.zeros(len(low))
    for _ in range(_STEPS):
        last, middle = middle, (low * above - high * below) / (above - below)
        found[moving] = middle
        still = np.abs(middle - last) >= TOLERANCE_CHIPS
        if not still.all():
            low, high, below, above, stale, middle = (
                column[still] for column in (low, high, below, above, stale, middle)
            )
            moving, total = moving[still], total[still]
            if not len(moving):
                break
        value = discriminator(loop.discriminator, *total.at(loop.correlate, middle[:, None] + shift).T)
        up = value > 0
        # An end that stays twice counts half, lest only the other move.
        below = np.where(up, np.where(stale > 0, below / 2, below), value)
        above = np.where(up, value, np.where(stale < 0, above / 2, above))
        low, high = np.where(up, low, middle), np.where(up, middle, high)
        stale = np.where(up, 1.0, -1.0)
    return found


def lock(loop: CodeLoop, direct: F64, delay_m: F64, coefficient: C128, wave_m: F64, chip_m: F64) -> Lock:
    """What channels settle at; arguments as `rays`.

    The carrier loop follows the prompt sum, whose phase is that of the strongest ray and a remainder within
    half a turn: so it runs on smoothly where a reflection alone is tracked through many cycles.
    """
    total = rays(direct, delay_m, coefficient, wave_m, chip_m)
    code_chips, prompt = settle(loop, total)
    there = np.abs(total.amplitude) * loop.correlate(code_chips[:, None] - total.delay_chips)
    row, strongest = np.arange(len(direct)), there.argmax(axis=1)
    path_m = np.hstack((np.zeros((len(direct), 1)), delay_m))
    carrier = np.hstack((direct[:, None].astype(complex), coefficient))
    own_rad = 2 * np.pi * path_m[row, strongest] / wave_m - np.angle(carrier[row, strongest])
    rest_rad = np.angle(prompt * np.exp(1j * own_rad))
    return Lock(code_chips, np.where(prompt == 0, 0.0, own_rad - rest_rad), np.abs(prompt))


def strongest(pair: I64, pairs: int, count: int, delay_m: F64, coefficient: C128, least: float) -> I64:
    """Rows (pairs, count) of each pair's strongest reflections among k, -1 where there are fewer.

    pair (k,), delay_m (k,), coefficient (k,)   of the reflections;  least   amplitudes below it are left out
    """
    size = np.abs(coefficient)
    kept = np.flatnonzero(size >= least)
    order = kept[np.lexsort((delay_m[kept], -size[kept], pair[kept]))]
    owner = pair[order]
    rank = np.arange(len(order)) - np.searchsorted(owner, owner)
    out = np.full((pairs, count), -1)
    fits = rank < count
    out[owner[fits], rank[fits]] = order[fits]
    return out
