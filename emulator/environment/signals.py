"""Signals of a block: what receivers would measure of a satellite at an antenna, if a channel had it.

P = c t + c b - clock_truth: path with the receiver's clock and without the satellite's. Its rate and the
carrier follow the same sum, so nothing but the models tells them apart.

Step 3 and block 2 of RU 2706636 C1: ranges from times of transmission and reception, and the satellites'
coordinates with them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.constellation.sky import SkyState
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.environment import models as joined
from gnss_hil.emulator.environment.block import Block, Environment, channel_geometry, with_level
from gnss_hil.emulator.error_models.base import PathTerm
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.data_frames import units_begun
from gnss_hil.emulator.signal.geometry import at_transmission
from gnss_hil.emulator.signal.group_delays import beyond_first_m


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """p signals of a block.

    at            epoch, antenna and satellite of each, C/N0 as measured
    pseudorange_m, range_rate_mps   (p,)
    cycles        (p,) carrier phase from transmission on [cycles]
    turns_cyc     (p,) to be added to it, known but for whole cycles; None: nothing is
    arc           (p,) number of the phase arc: a phase is continuous along one alone. Where a satellite
                  changes its ephemeris the truth may jump, see `gnss_hil.emulator.constellation.sky`; where
                  the direct ray is hidden or comes back, a loop goes over to another ray, metres longer or
                  shorter
    half_cycles   (p,) by which a loop slips in the epoch; None: never
    preamble      (p,) whether the satellite has begun a subframe or string since the epoch before; None if
                  nothing slips
    pos_ecef_m, vel_ecef_mps   (p, 3) satellite as reported, at transmission, axes of that instant
    clock_m, clock_drift_mps   (p,) as reported, at transmission
    """

    at: ChannelGeometry
    pseudorange_m: F64
    range_rate_mps: F64
    cycles: F64
    turns_cyc: F64 | None
    arc: I64
    half_cycles: I64 | None
    preamble: Bool | None
    pos_ecef_m: F64
    vel_ecef_mps: F64
    clock_m: F64
    clock_drift_mps: F64


def signals(env: Environment, block: Block, epoch: I64, antenna: I64, column: I64) -> Signals:
    """Signals in these columns (see `gnss_hil.emulator.signal.carriers`) at antennas in epochs of a block,
    (p,) each, that are receivable there."""
    epochs, sky = block.geometry, block.geometry.sky
    at, term = _disturbed(
        env, channel_geometry(env, epochs, block.cn0_dbhz, block.hidden, epoch, antenna, column)
    )
    flight_s, rate_mps, satellite = at.path.flight_s, at.path.rate_mps, (epoch, at.row)
    domain = env.vehicle.clock_domain[antenna]
    sv_drift_mps = sky.clock_truth_mps[satellite]
    sv_clock_m = sky.clock_truth_m[satellite] - sv_drift_mps * flight_s
    clock_m = sky.clock_m[satellite] - sky.clock_drift_mps[satellite] * flight_s
    if env.carriers.ranks > 1:
        # Satellites' delays are as they broadcast them; where codes differ beside, an error model has it.
        delays_m = sky.broadcast.group_delay_m[satellite], sky.broadcast.band_delay_m[satellite]
        own_m = beyond_first_m(at.signal, *delays_m)
        sv_clock_m, clock_m = sv_clock_m + own_m, clock_m + own_m
    exact_m = at.path.length_m + LIGHT_MPS * epochs.clock[epoch, 0, domain] - sv_clock_m
    # The satellite's clock runs at the transmission instant, which moves at 1 - rate / c.
    exact_mps = (
        rate_mps + LIGHT_MPS * epochs.clock[epoch, 1, domain] - sv_drift_mps * (1 - rate_mps / LIGHT_MPS)
    )
    pos, vel = reported_at_transmission(sky, satellite, flight_s)
    slips = joined.tracking(env.models, at).half_cycles
    return Signals(
        at=at,
        pseudorange_m=exact_m + term.range_m,
        range_rate_mps=exact_mps + term.rate_mps,
        cycles=(exact_m + term.phase_m) / at.wave_m,
        turns_cyc=term.turns_cyc,
        arc=2 * sky.broadcast.ephemeris[satellite] + at.hidden,
        half_cycles=slips,
        preamble=None if slips is None else _preamble(env, at),
        pos_ecef_m=pos,
        vel_ecef_mps=vel,
        clock_m=clock_m,
        clock_drift_mps=sky.clock_drift_mps[satellite],
    )


def _disturbed(env: Environment, at: ChannelGeometry) -> tuple[ChannelGeometry, PathTerm]:
    """The signals with the C/N0 that is measured, and the sum of what the path's models add."""
    paths = joined.path_models(env.models)
    led = paths.led(at)
    if paths.leading:
        # What is received of a hidden satellite has its level already.
        at = with_level(at, np.where(at.hidden, at.cn0_dbhz, at.cn0_dbhz + led.level_db))
    followed = paths.followed(at)
    if np.any(followed.level_db):
        at = with_level(at, at.cn0_dbhz + followed.level_db)
    return at, led + followed


def _preamble(env: Environment, at: ChannelGeometry) -> Bool:
    t_ns = at.epochs.t_ns[at.at]
    return units_begun(at.system, t_ns) != units_begun(at.system, t_ns - env.interval_ns)


def reported_at_transmission(sky: SkyState, satellite, flight_s: F64) -> tuple[F64, F64]:
    """Positions and velocities (p, 3) that satellites report of their transmission instants; `satellite`
    picks them, (p,), from the sky's arrays."""
    pos, vel = at_transmission(sky, satellite, flight_s)
    if sky.off_ecef_m is None or sky.off_ecef_mps is None:
        return pos, vel
    rate = sky.off_ecef_mps[satellite]
    return pos + sky.off_ecef_m[satellite] - flight_s[:, None] * rate, vel + rate
