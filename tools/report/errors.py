"""How wrong the fixes of a run are, along the axes of the orbit, and what their covariance says to that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.tools.report.frames import Vectors, covariance, sigmas_along
from gnss_hil.tools.results.consistency import clock_nees, position_nees, velocity_nees
from gnss_hil.tools.results.summary import LIGHT_MPS

PAIRS = ("xy", "xz", "yz")

Fixes = Mapping[str, F64]
"""Columns of fixes (e,) on time marks; nan where there is no valid one."""


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Fix minus truth of one quantity on time marks, nan where there is nothing.

    value   (e, 3) radial, along, cross
    sigma   (e, 3) the same directions, by the flight software's covariance
    nees    (e,) normalised squared error
    """

    value: Vectors
    sigma: Vectors
    nees: F64


@dataclass(frozen=True, slots=True, eq=False)
class ClockErrors:
    """Of the lowest oscillator's bias on time marks, (e,): fix minus truth [m], and normalised squared."""

    value_m: F64
    nees: F64


def position_errors(axes: F64, fixes: Fixes, truth_m: Vectors) -> Errors:
    """axes (e, 3, 3): rows radial, along, cross; truth_m (e, 3) ECEF."""
    error = vectors(fixes, "{}_m") - truth_m
    sigma = vectors(fixes, "sigma_{}_m")
    return _errors(axes, error, sigma, correlations(fixes, "rho_{}"), position_nees(fixes, error))


def velocity_errors(axes: F64, fixes: Fixes, truth_mps: Vectors) -> Errors:
    """The same of velocities relative to the Earth, (e, 3) ECEF."""
    error = vectors(fixes, "v{}_mps") - truth_mps
    sigma = vectors(fixes, "sigma_v{}_mps")
    return _errors(axes, error, sigma, correlations(fixes, "rho_v{}"), velocity_nees(fixes, error))


def clock_errors(fixes: Fixes, truth_s: F64) -> ClockErrors:
    """truth_s (e,): receiver clock minus GPS time."""
    truth_m = LIGHT_MPS * truth_s
    return ClockErrors(fixes["clock_bias_m"] - truth_m, clock_nees(fixes, truth_m))


def vectors(columns: Fixes, pattern: str) -> Vectors:
    return np.column_stack([columns[pattern.format(axis)] for axis in "xyz"])


def correlations(columns: Fixes, pattern: str) -> Vectors:
    return np.column_stack([columns[pattern.format(pair)] for pair in PAIRS])


def _errors(axes: F64, error: Vectors, sigma: Vectors, rho: Vectors, nees: F64) -> Errors:
    along = np.einsum("nij,nj->ni", axes, error)
    reported = sigmas_along(axes, covariance(sigma, rho))
    return Errors(along, np.where(np.isnan(along), np.nan, reported), nees)
