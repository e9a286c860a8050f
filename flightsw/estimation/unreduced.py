"""A fix of antennas, published as one of the centre of mass: by how much it is not.

`NAV_*` is of the centre of mass. Comparisons that by their nature know no reduction publish where antennas
are: off by a lever arm, which is no noise but the same from epoch to epoch. What they publish with it is the
mean square of the error, that of the antennas' place and the square of the lever arm: with the attitude known
along the lever arm, else in every direction alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.attitude.attitude import Attitude, levers_ecef
from gnss_hil.flightsw.records.solution import SnapshotFix


def for_centre_of_mass(fix: SnapshotFix, lever_body_m: F64, attitude: Attitude | None) -> SnapshotFix:
    """A fix of the point lever_body_m (3,), body axes, from the centre of mass: the same with the covariances
    that it has as a fix of the centre of mass."""
    if attitude is None:
        place_m2, motion_m2ps2 = _any_way(fix, float(lever_body_m @ lever_body_m))
    else:
        lever, rate = levers_ecef(attitude, lever_body_m[None])
        place_m2, motion_m2ps2 = lever.T @ lever, rate.T @ rate
    of_motion = fix.velocity_covariance_m2ps2
    return replace(
        fix,
        covariance_m2=fix.covariance_m2 + place_m2,
        velocity_covariance_m2ps2=None if of_motion is None else of_motion + motion_m2ps2,
    )


def _any_way(fix: SnapshotFix, square_m2: float) -> tuple[F64, F64]:
    """Mean squares (3, 3) of a lever arm, by its square, and of its rate where no attitude is known: of all
    directions, on a craft that turns as one that points at the Earth."""
    each_m2 = np.eye(3) * (square_m2 / 3)
    if fix.velocity_mps is None:
        return each_m2, np.zeros((3, 3))
    place, turning = fix.position_m, np.cross(fix.position_m, fix.velocity_mps)
    return each_m2, each_m2 * float(turning @ turning / (place @ place) ** 2)
