"""The attitude as the on-board computer estimates it: gyros that drift, corrected by a star sensor.

Between star fixes the computer integrates its gyros. Their noise makes the attitude walk, their drift, which
walks itself, makes it run away. At a fix the computer corrects attitude and drift with the constant gains its
Kalman filter settles at. Axes are alike and independent, angles small. What is followed here is the error:
the turn that takes the true body axes into those of the estimate.

Source: Farrenkopf, "Analytic steady-state accuracy solutions for two common spacecraft attitude estimators",
J. Guidance and Control 1 (1978) 282; Markley & Crassidis, Fundamentals of Spacecraft Attitude Determination
and Control (2014), 6
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.clocks.oscillator import spread
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.numerics.rotations import product

_AXES = 3


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """angle_rad (3,) body axes as estimated, turned from the true ones; rate_rps (3,) estimated minus true
    rate; drift_rps (3,) drift of the gyros that the computer does not know of; all in body axes."""

    angle_rad: F64
    rate_rps: F64
    drift_rps: F64


@dataclass(frozen=True, slots=True, eq=False)
class Sensors:
    """Gyros, star sensor and the filter's gains, for one length of epoch.

    dt_s              length of an epoch [s]
    white, walk       densities of rate noise [rad^2/s] and of what drives the drift [rad^2/s^3]
    epochs            from one star fix to the next; inf: there are none
    star_rad          1 sigma of a fix
    angle_gain        of a fix's innovation [rad] that corrects the attitude
    drift_gain        and that corrects the drift [1/s]
    initial           (2, 2) lower triangle of attitude and drift before the first epoch
    """

    dt_s: float
    white: float
    walk: float
    epochs: float
    star_rad: float
    angle_gain: float
    drift_gain: float
    initial: F64


def settled(white: float, walk: float, star_rad: float, interval_s: float) -> float:
    """What remains to be expected of a fix's innovation, 1 sigma, over the star sensor's own.

    Its square less one is the attitude's variance before a fix, one less its inverse square that after it,
    both over the sensor's. Source: Farrenkopf (1978), as in Markley & Crassidis (2014), typed from memory
    """
    s_u = sqrt(walk) * interval_s**1.5 / star_rad
    s_v = sqrt(white * interval_s) / star_rad
    gamma = sqrt(1 + s_v**2 / 4 + s_u**2 / 48)
    return gamma + s_u / 4 + sqrt(2 * gamma * s_u + s_v**2 + s_u**2 / 3) / 2


def after_a_fix(
    walk: float, star_rad: float, interval_s: float, ratio: float, angle_gain: float, drift_gain: float
) -> F64:
    """(2, 2) lower triangle of the covariance of attitude and unknown drift after a fix, settled.

    With K the gains, the covariance is K star^2 in its first column. The drift's follows from
    how the covariance of attitude and drift grows from one fix to the next: by T times the
    drift's, and T^2 / 2 of its walk.
    """
    angle = sqrt(angle_gain) * star_rad
    cross = drift_gain * star_rad**2
    before = drift_gain * (ratio * star_rad) ** 2
    drift = (before - cross) / interval_s - walk * interval_s / 2
    if angle == 0:
        return np.diag((0.0, sqrt(max(drift, 0.0))))
    return np.array(((angle, 0.0), (cross / angle, sqrt(max(drift - (cross / angle) ** 2, 0.0)))))


def at_start(parts: Sensors, standard: F64) -> Knowledge:
    """Before the first epoch, from (3, 2) standard normal numbers."""
    angle_rad, drift_rps = parts.initial @ standard.T
    return Knowledge(angle_rad, drift_rps, drift_rps)


def advance(parts: Sensors, state: Knowledge, standard: F64, epoch: int) -> Knowledge:
    """An epoch later.

    standard  (3, 3) standard normal numbers: axis; gyro noise, walk of drift, star sensor
    epoch     number of the epoch that is reached, which decides whether there is a star fix
    """
    noise = spread(parts.white, parts.walk, parts.dt_s) @ standard[:, :2].T
    turned_rad = parts.dt_s * state.drift_rps + noise[0]
    angle_rad, drift_rps = state.angle_rad + turned_rad, state.drift_rps + noise[1]
    if epoch % parts.epochs == 0:
        innovation_rad = angle_rad - parts.star_rad * standard[:, 2]
        angle_rad = angle_rad - parts.angle_gain * innovation_rad
        drift_rps = drift_rps - parts.drift_gain * innovation_rad
    return Knowledge(angle_rad, turned_rad / parts.dt_s, drift_rps)


def estimated(parts: Sensors, before: Knowledge | None, draws: Stream, epoch: int) -> Knowledge:
    """The knowledge of an epoch from that of the one before, None before the first."""
    standard = draws.normal_of_epoch(epoch, 3 * _AXES).reshape(_AXES, 3)
    if before is None:
        return at_start(parts, standard[:, :2])
    return advance(parts, before, standard, epoch)


def reported_quaternion(quaternion: F64, angle_rad: F64) -> F64:
    """Quaternions (..., 4) of body from ECEF as reported: the true ones, their body axes turned by angle_rad
    (..., 3)."""
    angle = np.sqrt(np.einsum("...k,...k->...", angle_rad, angle_rad))[..., None]
    part = 0.5 * np.sinc(angle / (2 * np.pi))  # sin(angle / 2) / angle
    turned = product(quaternion, np.concatenate((np.cos(angle / 2), part * angle_rad), axis=-1))
    return np.where(turned[..., :1] < 0, -turned, turned)
