"""The analogue of RU 2706636 C1: SIGI on the US segment of the ISS.

Each receiver solves alone, from its own antenna and on its own clock; the solutions are averaged with equal
weights. The position is the mean place of the antennas that have a solution: it differs from the centre of
mass by the mean lever arm, and steps when a receiver gains or loses its solution.

Receivers that have no solution are left out; if none has one, the reason is that of the receiver that came
nearest (`NEAREST_FIRST`). Position and velocity are of the same point, so if one of the averaged solutions
lacks a velocity, the mean has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.flightsw.estimation.antenna_alone import antenna_alone
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.clocks import ReceiverClocks, mean_clocks
from gnss_hil.flightsw.estimation.snapshot import Snapshot
from gnss_hil.flightsw.measurement.noise import URA_M
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import FASTEST_MPS, NoFix, SnapshotFix, carriable, within

NEAREST_FIRST = (
    NoFix.INCONSISTENT_RANGES,
    NoFix.NO_CONVERGENCE,
    NoFix.SINGULAR_GEOMETRY,
    NoFix.TOO_FEW_SATELLITES,
)
"""Reasons of receivers alone, in the order of how near to a fix they are: ranges that make a solution but
contradict each other, an iteration that ends nowhere, a geometry that has no solution, too few ranges."""


def receiver_mean(m: Ranges, inputs: FixInputs, prior: Snapshot) -> tuple[SnapshotFix | NoFix, int]:
    """The mean of the receivers' own solutions; no antenna is selected."""
    antennas = range(len(inputs.domain))
    found = [antenna_alone(m, antenna, inputs, prior.start_m) for antenna in antennas]
    fixes = [fix for fix in found if isinstance(fix, SnapshotFix)]
    if fixes:
        return mean_fix(m, fixes, inputs.ura_scale), prior.antenna
    reasons = {reason for reason in found if isinstance(reason, NoFix)}
    return next(reason for reason in NEAREST_FIRST if reason in reasons), prior.antenna


def mean_fix(m: Ranges, fixes: Sequence[SnapshotFix], ura_scale: float) -> SnapshotFix | NoFix:
    """The mean of at least one fix of receivers alone.

    The dilution is that of the mean for errors of the same size, independent from measurement to measurement,
    and the solutions have no measurement in common: PDOP^2 = sum PDOP_a^2 / k^2.
    """
    share = 1 / len(fixes)
    systems = [frozenset((m.sat[fix.used] // NUMBERS).tolist()) for fix in fixes]
    items, clock = mean_clocks(
        [ReceiverClocks(fix.items, fix.clock_m, s) for fix, s in zip(fixes, systems, strict=True)]
    )
    position = share * _sum([fix.position_m for fix in fixes])
    if not carriable(position, clock):
        return NoFix.NO_CONVERGENCE
    velocity, drift = _mean_rates(fixes, systems)
    used = np.any([fix.used for fix in fixes], axis=0)
    gain = share * _sum([fix.gain for fix in fixes])
    return SnapshotFix(
        position_m=position,
        velocity_mps=velocity,
        items=items,
        clock_m=clock,
        drift_mps=drift,
        covariance_m2=mean_covariance_m2(m, gain, ura_scale),
        gain=gain,
        pdop=share * sqrt(sum(fix.pdop**2 for fix in fixes)),
        used=used,
        satellites=len(set(m.sat[used].tolist())),
        residual_m=_residuals_m(fixes, len(m)),
        iterations=max(fix.iterations for fix in fixes),
        misfit=max(fix.misfit for fix in fixes),
    )


def _sum(arrays: Sequence[F64]) -> F64:
    """Elementwise, in their order."""
    total = np.zeros_like(arrays[0])
    for array in arrays:
        total = total + array
    return total


def _residuals_m(fixes: Sequence[SnapshotFix], n: int) -> F64:
    """(n,) of each measurement from its own receiver's solution, nan where not used."""
    residual = np.full(n, np.nan)
    for fix in fixes:
        residual[fix.used] = fix.residual_m[fix.used]
    return residual


def _mean_rates(
    fixes: Sequence[SnapshotFix], systems: Sequence[frozenset[int]]
) -> tuple[F64, F64] | tuple[None, None]:
    """Velocity (3,) and drifts (c,); None if a solution lacks them or the bus cannot carry them."""
    velocities = [fix.velocity_mps for fix in fixes if fix.velocity_mps is not None]
    drifts = [
        ReceiverClocks(fix.items, fix.drift_mps, s)
        for fix, s in zip(fixes, systems, strict=True)
        if fix.drift_mps is not None
    ]
    if len(velocities) < len(fixes) or len(drifts) < len(fixes):
        return None, None
    _, drift = mean_clocks(drifts)
    if not within(drift.tolist(), FASTEST_MPS):
        return None, None
    return _sum(velocities) / len(fixes), drift


def mean_covariance_m2(m: Ranges, gain: F64, ura_scale: float) -> F64:
    """Covariance (3, 3) of a position that moves by gain (3, n) for each metre of the pseudoranges.

    The code's noise is independent from measurement to measurement: with k solutions it is sum C_a / k^2. A
    satellite's own error (URA) is common to all receivers that measure it; it enters once, through the sum of
    their gains, and does not average out.
    """
    used = gain.any(axis=0)
    gain, sat, ura = gain[:, used], m.sat[used], m.ura[used].astype(np.intp)
    noise = (gain * m.code_variance_m2[used]) @ gain.T
    common = (gain * (ura_scale * URA_M[ura])) @ (sat[:, None] == np.unique(sat))
    return noise + common @ common.T
