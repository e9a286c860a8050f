"""The analogue of RU 2706636 C1: SIGI on the US segment of the ISS.

Each receiver solves alone, from its own antenna and on its own clock; the solutions are averaged with equal
weights. The position is the mean place of the antennas that have a solution: it differs from the centre of
mass by the mean lever arm, and steps when a receiver gains or loses its solution. The covariance is that of
the centre of mass and has the mean lever arm in it (`estimation.unreduced`).

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
from gnss_hil.flightsw.estimation.unreduced import for_centre_of_mass
from gnss_hil.flightsw.measurement.budget import range_errors
from gnss_hil.flightsw.measurement.ionosphere import delay_rate
from gnss_hil.flightsw.measurement.range_model import rays
from gnss_hil.flightsw.measurement.range_rate import range_rates
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import NoFix, SnapshotFix

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
    solved = {antenna: fix for antenna, fix in enumerate(found) if isinstance(fix, SnapshotFix)}
    if not solved:
        reasons = {reason for reason in found if isinstance(reason, NoFix)}
        return next(reason for reason in NEAREST_FIRST if reason in reasons), prior.antenna
    mean = mean_fix(m, list(solved.values()), inputs)
    lever_m = inputs.lever_arm_body_m[list(solved)].mean(axis=0)
    return for_centre_of_mass(mean, lever_m, inputs.attitude), prior.antenna


def mean_fix(m: Ranges, fixes: Sequence[SnapshotFix], inputs: FixInputs) -> SnapshotFix:
    """The mean of at least one fix of receivers alone, as a fix of the mean place of their antennas.

    The dilution is that of the mean for errors of the same size, independent from measurement to measurement,
    and the solutions have no measurement in common: PDOP^2 = sum PDOP_a^2 / k^2.
    """
    share = 1 / len(fixes)
    systems = [frozenset((m.sat[fix.used] // NUMBERS).tolist()) for fix in fixes]
    items, clock = mean_clocks(
        [ReceiverClocks(fix.items, fix.clock_m, s) for fix, s in zip(fixes, systems, strict=True)]
    )
    position = share * _sum([fix.position_m for fix in fixes])
    velocity, drift = _mean_rates(fixes, systems)
    of_velocity = of_drift = None
    if velocity is not None:
        of_velocity = _motion_covariance(m, fixes, position, velocity, inputs)
        of_drift = _mean_variances(fixes, items, "drift_variance_m2ps2")
    used = np.any([fix.used for fix in fixes], axis=0)
    gain = share * _sum([fix.gain for fix in fixes])
    return SnapshotFix(
        position_m=position,
        velocity_mps=velocity,
        items=items,
        clock_m=clock,
        drift_mps=drift,
        covariance_m2=mean_covariance_m2(m, gain, position, inputs),
        velocity_covariance_m2ps2=of_velocity,
        clock_variance_m2=_mean_variances(fixes, items, "clock_variance_m2"),
        drift_variance_m2ps2=of_drift,
        gain=gain,
        pdop=share * sqrt(sum(fix.pdop**2 for fix in fixes)),
        used=used,
        satellites=len(set(m.sat[used].tolist())),
        residual_m=_residuals_m(fixes, len(m)),
        iterations=max(fix.iterations for fix in fixes),
        velocity_gain=None if velocity is None else share * _sum(_velocity_gains(fixes)),
        rate_misfit=max(fix.rate_misfit for fix in fixes),
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
    """Velocity (3,) and drifts (c,); None if a solution lacks them."""
    velocities = [fix.velocity_mps for fix in fixes if fix.velocity_mps is not None]
    drifts = [
        ReceiverClocks(fix.items, fix.drift_mps, s)
        for fix, s in zip(fixes, systems, strict=True)
        if fix.drift_mps is not None
    ]
    if len(velocities) < len(fixes) or len(drifts) < len(fixes):
        return None, None
    _, drift = mean_clocks(drifts)
    return _sum(velocities) / len(fixes), drift


def mean_covariance_m2(m: Ranges, gain: F64, position_m: F64, inputs: FixInputs) -> F64:
    """Covariance (3, 3) of a position (3,) that moves by gain (3, n) for each metre of the pseudoranges.

    What several receivers have in common, a satellite's own error or the ionosphere, enters once, through the
    sum of their gains, and does not average out. Lever arms turn no ray by more than 1e-6 rad.
    """
    used = np.flatnonzero(gain.any(axis=0))
    z, gain = m[used], gain[:, used]
    errors = range_errors(z, inputs.budget, inputs.ionosphere)
    return _propagated(gain, *errors.along(rays(z.pos_sv_m, np.repeat(position_m[:, None], len(z), axis=1))))


def _propagated(gain: F64, own: F64, common: F64) -> F64:
    """(3, 3) by gain (3, n): of errors with variances own (n,), and of some in common, (n, k)."""
    in_common = gain @ common
    return (gain * own) @ gain.T + in_common @ in_common.T


def _motion_covariance(
    m: Ranges, fixes: Sequence[SnapshotFix], position_m: F64, velocity_mps: F64, inputs: FixInputs
) -> F64:
    """(3, 3) of the mean of velocities, every fix having one; as large as the worst of them is misfit."""
    gain = _sum(_velocity_gains(fixes)) / len(fixes)
    covariance = mean_velocity_covariance(m, gain, position_m, velocity_mps, inputs)
    return covariance * max(fix.rate_misfit for fix in fixes)


def _velocity_gains(fixes: Sequence[SnapshotFix]) -> list[F64]:
    """(3, n) of each, every fix having a velocity."""
    return [gain for fix in fixes if (gain := fix.velocity_gain) is not None]


def mean_velocity_covariance(
    m: Ranges, gain: F64, position_m: F64, velocity_mps: F64, inputs: FixInputs
) -> F64:
    """Covariance (3, 3) of a velocity (3,) that moves by gain (3, n) for each m/s of the range rates: as
    `mean_covariance_m2` of the position."""
    used = np.flatnonzero(gain.any(axis=0))
    z, gain = m[used], gain[:, used]
    seen = rays(z.pos_sv_m, np.repeat(position_m[:, None], len(z), axis=1))
    rates = range_rates(z, np.zeros((len(z), 3)), seen, np.zeros((3, len(z))))
    if inputs.ionosphere is not None and z.electrons.any():
        antenna_mps = np.repeat(velocity_mps[:, None], len(z), axis=1)
        rates = rates.without(delay_rate(inputs.ionosphere, seen, antenna_mps, z.vel_sv_mps), z.electrons)
    return _propagated(gain, *rates.errors())


def _mean_variances(fixes: Sequence[SnapshotFix], items: tuple[int, ...], name: str) -> F64:
    """(c,) of clocks or their rates: the mean over the receivers that have an item, as if what they err by
    were the same error."""
    values: list[F64] = [getattr(fix, name) for fix in fixes]
    each = [dict(zip(fix.items, v.tolist(), strict=True)) for fix, v in zip(fixes, values, strict=True)]
    every = [np.mean(v) for v in values]
    return np.array([float(np.mean([of[item] for of in each if item in of] or every)) for item in items])
