"""What carrier loops remember: how far antennas have wound a phase up, and whole or half cycles they slipped.

Both are of a channel, from its phase's start on: wind-up is counted on through whole turns, a slip stays.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.error_models.params_loops import Loops
from gnss_hil.emulator.error_models.params_receiver import CycleSlips
from gnss_hil.emulator.receivers.emulated.channels import SLIPS, Channels, Flags
from gnss_hil.emulator.receivers.emulated.data_collection import units_begun
from gnss_hil.emulator.signal import phase_windup
from gnss_hil.emulator.signal.channel_geometry import NONE, Disturbance, Rays
from gnss_hil.emulator.signal.geometry import Array
from gnss_hil.emulator.signal.tracking_loss import slips

SLIP_SLOT = 3
"""Place of the slips' words among those of a receiver and satellite; the loops' noise has the first three."""


@dataclass(frozen=True, slots=True, eq=False)
class Carrier:
    """How a craft's carrier phases come about.

    antenna_axes_body   x and y (m, 3) of its antennas, None where nothing winds up
    slips               None: never
    loops               what noise makes slip
    interval_s          between epochs
    """

    antenna_axes_body: tuple[Array, Array] | None = None
    slips: CycleSlips | None = None
    loops: Loops = field(default_factory=Loops)
    interval_s: float = 1.0


PLAIN = Carrier()


def wind(carrier: Carrier, channels: Channels, begins: Flags, rays: Rays) -> tuple[Disturbance, Channels]:
    """The wind-up of the measured signals, and channels that remember it."""
    if carrier.antenna_axes_body is None or not len(rays):
        return NONE, channels
    scene, receiver, channel = rays.scene, rays.receiver, rays.channel
    axes = tuple((axis @ scene.dcm_body_from_ecef)[receiver] for axis in carrier.antenna_axes_body)
    cycles, rate = phase_windup.wound_in_motion(
        scene.motion.pos_m[rays.row],
        scene.motion.vel_mps[rays.row],
        scene.sun_ecef_m,
        scene.antennas.pos_m[receiver],
        scene.antennas.vel_mps[receiver],
        axes,
        scene.rate_body_rps @ scene.dcm_body_from_ecef,
    )
    before = np.where(begins, np.nan, channels.wound_cyc)[receiver, channel]
    now = phase_windup.continued(cycles, before)
    wound = np.full_like(channels.wound_cyc, np.nan)
    wound[receiver, channel] = now
    disturbance = Disturbance(phase_m=now * rays.wave_m, rate_mps=rate * rays.wave_m)
    return disturbance, replace(channels, wound_cyc=wound)


def slip(carrier: Carrier, channels: Channels, begins: Flags, rays: Rays) -> Channels:
    """Channels whose phases have slipped in this epoch: counted, and off from now on. One that begins has
    nothing to slip from.

    After half a cycle the data are upside down, which the next subframe or string tells by its preamble: the
    receiver then turns its phase by the other half, and counts that too.
    """
    if carrier.slips is None or not len(rays):
        return channels
    half_cycles = slips(
        carrier.slips, carrier.loops, rays.words[:, SLIP_SLOT], rays.cn0_dbhz, carrier.interval_s
    )
    place = rays.receiver, rays.channel
    goes_on, before = ~begins[place], channels.ambiguity[place]
    whole = np.where(_upright(rays, carrier.interval_s), np.floor(before), before)
    moved = goes_on & ((whole != before) | (half_cycles != 0))
    if not moved.any():
        return channels
    ambiguity, counted = channels.ambiguity.copy(), channels.slips.copy()
    ambiguity[place] = np.where(moved, whole - half_cycles / 2, before)
    counted[place] = (counted[place] + moved) % SLIPS
    return replace(channels, ambiguity=ambiguity, slips=counted)


def _upright(rays: Rays, interval_s: float) -> Flags:
    """(p,) whether satellites have begun a subframe or string since the last epoch."""
    t_ns = rays.scene.t_ns
    before_ns = t_ns - round(interval_s * NS_PER_S)
    return units_begun(rays.system, t_ns) != units_begun(rays.system, before_ns)


def doubtful(channels: Channels) -> Flags:
    """(m, k) phases that are off by half a cycle: whether by half of one nobody knows yet."""
    return channels.ambiguity % 1 != 0
