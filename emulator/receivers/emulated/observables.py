"""Observations: what the measuring channels of a craft tell of their satellites in one epoch.

Step 3 and block 2 of RU 2706636 C1: ranges from times of transmission and reception, and the satellites'
coordinates with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.constellation.sky import SkyState
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.receivers.emulated.carrier import PLAIN, Carrier, doubtful, slip, wind
from gnss_hil.emulator.receivers.emulated.channels import FULL, SLIPS, Channels, Flags, Numbers
from gnss_hil.emulator.signal import structure_effects
from gnss_hil.emulator.signal.bands import BY_SYSTEM, wavelength_m
from gnss_hil.emulator.signal.channel_geometry import Effect, Rays, total
from gnss_hil.emulator.signal.epoch_geometry import Scene
from gnss_hil.emulator.signal.geometry import Array, at_transmission, path

PHASE_LIMIT_CYC = 1.3e8
"""Where the carrier phase is restarted: its signal on the bus ends at 1.37e8 cycles."""


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """One row for each measuring channel, by receiver and channel; names and conventions of the contract.

    receiver        (p,) 0-based;  channel (p,);  row (p,) of the sky;  sat (p,) satellite index
    signal          (p,) value of the contract's table "Signal"
    pseudorange_m, range_rate_mps, phase_cyc, cn0_dbhz   (p,)
    slips           (p,);  half_cycle (p,) whether half a cycle is in doubt
    pos_ecef_m, vel_ecef_mps   (p, 3) satellite at transmission, axes of that instant
    clock_m, clock_drift_mps   (p,) as broadcast, at transmission
    """

    receiver: Numbers
    channel: Numbers
    row: Numbers
    sat: Numbers
    signal: Numbers
    pseudorange_m: Array
    range_rate_mps: Array
    phase_cyc: Array
    cn0_dbhz: Array
    slips: Numbers
    half_cycle: Flags
    pos_ecef_m: Array
    vel_ecef_mps: Array
    clock_m: Array
    clock_drift_mps: Array


def observe(
    channels: Channels,
    begins: Flags,
    scene: Scene,
    effects: Sequence[Effect],
    words: NDArray[np.uint64] | None,
    carrier: Carrier = PLAIN,
) -> tuple[Observations, Channels]:
    """Observations of one craft, and its channels with the carrier phases' ambiguities: block 2 of
    RU 2706636 C1 for all its antennas at once.

    begins    (m, k) channels whose phase starts now
    effects   error factors at work
    words     random words of the epoch, `draws.grid`; None if nothing draws any
    carrier   how carrier phases come about

    P = c t + c b - clock_truth: path with the receiver's clock and without the satellite's. Its rate and
    the carrier follow the same sum, so nothing but the effects tells them apart.
    """
    sky = scene.sky
    rays = measured(channels, scene, words)
    receiver, channel, row, signals = rays.receiver, rays.channel, rays.row, rays.path
    offset_s, drift = scene.clock_s
    sv_drift_mps = sky.clock_truth_mps[row]
    sv_clock_m = sky.clock_truth_m[row] - sv_drift_mps * signals.flight_s
    exact_m = signals.length_m + LIGHT_MPS * offset_s[receiver] - sv_clock_m
    # The satellite's clock runs at the transmission instant, which moves at 1 - rate / c.
    exact_mps = (
        signals.rate_mps + LIGHT_MPS * drift[receiver] - sv_drift_mps * (1 - signals.rate_mps / LIGHT_MPS)
    )
    wound, channels = wind(carrier, channels, begins, rays)
    error = total(effects, rays) + wound
    channels = slip(carrier, channels, begins, rays)
    cycles = (exact_m + error.phase_m) / rays.wave_m
    phase_cyc, channels = _start_phases(channels, begins, receiver, channel, cycles, ways(rays))
    pos, vel = reported_at_transmission(sky, row, signals.flight_s)
    return Observations(
        receiver=receiver,
        channel=channel,
        row=row,
        sat=rays.sat,
        signal=BY_SYSTEM.signal[rays.system],
        pseudorange_m=exact_m + error.range_m,
        range_rate_mps=exact_mps + error.rate_mps,
        phase_cyc=phase_cyc,
        cn0_dbhz=rays.cn0_dbhz,
        slips=channels.slips[receiver, channel],
        half_cycle=doubtful(channels)[receiver, channel],
        pos_ecef_m=pos,
        vel_ecef_mps=vel,
        clock_m=sky.clock_m[row] - sky.clock_drift_mps[row] * signals.flight_s,
        clock_drift_mps=sky.clock_drift_mps[row],
    ), channels


def measured(channels: Channels, scene: Scene, words: NDArray[np.uint64] | None) -> Rays:
    """The signals that channels measure now."""
    antennas = scene.antennas
    receiver, channel = np.nonzero(channels.lock == FULL)
    row = channels.target[receiver, channel]
    sat = scene.sky.index[row]
    system = satellites.system_of(sat)
    wave_m = wavelength_m(system, scene.sky.frequency[row])
    cn0_dbhz = scene.cn0_dbhz[receiver, row]
    reception = None
    if scene.around is not None:
        reception = structure_effects.receive(scene.around, receiver, row, system, wave_m)
    if reception is not None:
        # What is heard of a hidden satellite has its level already.
        hidden = scene.around.hidden[receiver, row]
        cn0_dbhz = np.where(hidden, cn0_dbhz, cn0_dbhz + reception.level_db)
    return Rays(
        scene,
        receiver,
        channel,
        row,
        sat,
        system,
        wave_m,
        BY_SYSTEM.chip_m[system],
        cn0_dbhz,
        path(scene.motion[row], antennas.pos_m[receiver], antennas.vel_mps[receiver]),
        words[system, receiver, satellites.number_of(sat)] if words is not None else None,
        reception,
    )


def reported_at_transmission(sky: SkyState, row: Numbers, flight_s: Array) -> tuple[Array, Array]:
    """Positions and velocities (p, 3) that satellites report of their transmission instants."""
    pos, vel = at_transmission(sky, row, flight_s)
    if sky.off_ecef_m is None:
        return pos, vel
    rate = sky.off_ecef_mps[row]
    return pos + sky.off_ecef_m[row] - flight_s[:, None] * rate, vel + rate


def ways(rays: Rays) -> Numbers:
    """(p,) numbers of the ways along which carrier phases are counted: a phase is continuous along one alone.

    Where a satellite changes its ephemeris the truth jumps, see `emulator.constellation.sky`; where the
    direct ray is hidden or comes back, its loop goes over to another ray, metres longer or shorter.
    """
    around = rays.scene.around
    hidden = 0 if around is None else around.hidden[rays.receiver, rays.row]
    return 2 * rays.scene.sky.ephemeris[rays.row] + hidden


def _start_phases(
    channels: Channels, begins: Flags, receiver: Numbers, channel: Numbers, cycles: Array, way: Numbers
) -> tuple[Array, Channels]:
    """Carrier phases (p,) [cycles] less their ambiguities, which are set where a phase starts.

    A phase about to leave its signal's range starts anew, which is a slip; so does one whose way (p,) is
    another.
    """
    ambiguity = channels.ambiguity[receiver, channel]
    breaks = np.abs(cycles - ambiguity) > PHASE_LIMIT_CYC
    breaks |= way != channels.way[receiver, channel]
    starts = begins[receiver, channel]
    if not (starts.any() or breaks.any()):
        return cycles - ambiguity, channels
    starts, slipped = starts | breaks, breaks & ~starts
    ambiguity = np.where(starts, np.floor(cycles), ambiguity)
    table, slips, counted = channels.ambiguity.copy(), channels.slips.copy(), channels.way.copy()
    table[receiver, channel] = ambiguity
    slips[receiver, channel] = (slips[receiver, channel] + slipped) % SLIPS
    counted[receiver, channel] = way
    return cycles - ambiguity, replace(channels, ambiguity=table, slips=slips, way=counted)
