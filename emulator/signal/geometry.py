"""The way of a signal: flight time, path length and its rate, exact to the micrometre.

Everything happens in the inertial frame whose axes are those of ECEF at the instant of reception. There
the Earth's rotation during the flight needs no correction of its own, and light runs straight but for
the Shapiro delay.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.earth.constants import LIGHT_MPS, MU_M3PS2, ROTATION_RPS

SHAPIRO_M = 2 * MU_M3PS2 / LIGHT_MPS**2
"""Scale of the gravitational delay, 8.87 mm. IERS Conventions (2010), eq. 11.17, with gamma = 1."""


class EcefMotion(Protocol):
    """Positions (..., 3) with first and second time derivatives in ECEF, as `SkyState` has them."""

    @property
    def pos_ecef_m(self) -> F64: ...
    @property
    def vel_ecef_mps(self) -> F64: ...
    @property
    def acc_ecef_mps2(self) -> F64: ...


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Inertial motion, axes of ECEF at the instant t it belongs to; (..., 3) each.

    pos_m [m], vel_mps [m/s], acc_mps2 [m/s^2]
    """

    pos_m: F64
    vel_mps: F64
    acc_mps2: F64

    def __getitem__(self, rows) -> Motion:
        return Motion(self.pos_m[rows], self.vel_mps[rows], self.acc_mps2[rows])


def spin(vectors: F64) -> F64:
    """omega_earth x v of vectors (..., 3)."""
    out = np.zeros_like(vectors)
    out[..., 0] = -ROTATION_RPS * vectors[..., 1]
    out[..., 1] = ROTATION_RPS * vectors[..., 0]
    return out


def inertial(state: EcefMotion) -> Motion:
    """Inertial velocity and acceleration from those relative to the turning Earth."""
    turning = spin(state.pos_ecef_m)
    return Motion(
        state.pos_ecef_m,
        state.vel_ecef_mps + turning,
        state.acc_ecef_mps2 + spin(2 * state.vel_ecef_mps + turning),
    )


def norm(vectors: F64) -> F64:
    """Lengths of vectors (..., 3)."""
    return np.sqrt(np.einsum("...k,...k->...", vectors, vectors))


def angle_rad(one: F64, other: F64) -> F64:
    """Angles (...,) [rad] between unit vectors (..., 3), accurate near 0 and pi too.

    Source: Kahan, "How Futile are Mindless Assessments of Roundoff", 2006, section 12
    """
    return 2 * np.arctan2(norm(one - other), norm(one + other))


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Signal paths, one row for each pair of satellite and antenna.

    flight_s   (p,) GPS time from transmission to reception [s]
    length_m   (p,) c times it: geometric distance and Shapiro delay [m]
    rate_mps   (p,) its derivative by GPS time of reception [m/s]
    """

    flight_s: F64
    length_m: F64
    rate_mps: F64


def path(satellite: Motion, pos_m: F64, vel_mps: F64) -> Path:
    """Signals from satellites to antennas, both at the instant of reception.

    satellite       motion of the transmitting antennas (p, 3) at *reception*; the transmission instant is
                    reached by Taylor's series. Its next term, jerk t^3 / 6, is below 0.02 um for GPS
    pos_m, vel_mps  (p, 3) inertial position and velocity of the receiving antennas

    One Newton step from the distance at reception: its error is second order in a step of 1 us and
    stays below a nanometre. The rate of the Shapiro delay (below 1e-5 m/s) is left out.
    """
    towards = satellite.pos_m - pos_m
    first_s = (norm(towards) / LIGHT_MPS)[:, None]
    towards += first_s * (0.5 * first_s * satellite.acc_mps2 - satellite.vel_mps)
    vel_tx_mps = satellite.vel_mps - first_s * satellite.acc_mps2
    distance_m = norm(towards)
    los = towards / distance_m[:, None]
    closing_mps = np.einsum("pk,pk->p", los, vel_tx_mps)
    delay_m = shapiro_m(norm(satellite.pos_m), norm(pos_m), distance_m)
    # c t = |r(t)| + delay, with d|r|/dt = -closing as the transmission moves back in time.
    first_s = first_s[:, 0]
    flight_s = first_s + (distance_m + delay_m - LIGHT_MPS * first_s) / (LIGHT_MPS + closing_mps)
    # c dt/dT = los . (v_tx (1 - dt/dT) - v_rx)
    opening_mps = closing_mps - np.einsum("pk,pk->p", los, vel_mps)
    rate_mps = opening_mps / (1 + closing_mps / LIGHT_MPS)
    return Path(flight_s, LIGHT_MPS * flight_s, rate_mps)


def shapiro_m(radius_tx_m: F64, radius_rx_m: F64, distance_m: F64) -> F64:
    """Gravitational delay of a signal [m], by the Earth alone.

    Source: IERS Conventions (2010), eq. 11.17
    """
    both = radius_tx_m + radius_rx_m
    return SHAPIRO_M * np.log((both + distance_m) / (both - distance_m))


def at_transmission(state: EcefMotion, rows: I64, flight_s: F64) -> tuple[F64, F64]:
    """ECEF positions and velocities (p, 3) at the transmission instants, in the axes of those instants.

    state     satellites at reception;  rows (p,) which of them;  flight_s (p,)
    """
    back_s = flight_s[:, None]
    vel, acc = state.vel_ecef_mps[rows], state.acc_ecef_mps2[rows]
    pos = state.pos_ecef_m[rows] + back_s * (0.5 * back_s * acc - vel)
    return pos, vel - back_s * acc


@dataclass(frozen=True, slots=True, eq=False)
class Antennas:
    """Antennas of one craft at the instants of reception; (..., m, 3) each, axes of ECEF.

    pos_m           phase centre [m]
    vel_mps         its inertial velocity [m/s]
    boresight       unit vector
    """

    pos_m: F64
    vel_mps: F64
    boresight: F64


def antennas(
    craft: EcefMotion,
    dcm_body_from_ecef: F64,
    rate_body_rps: F64,
    lever_body_m: F64,
    boresight_body: F64,
) -> Antennas:
    """Where the antennas of a craft are and look, at one instant or several (...).

    craft               centre of mass, (..., 3) each
    dcm_body_from_ecef  (..., 3, 3)
    rate_body_rps       (..., 3) relative to inertial space [rad/s]
    lever_body_m, boresight_body   (m, 3)
    """
    centre_mps = craft.vel_ecef_mps + spin(craft.pos_ecef_m)
    turning = np.swapaxes(cross_matrix(rate_body_rps), -1, -2) @ dcm_body_from_ecef
    return Antennas(
        craft.pos_ecef_m[..., None, :] + lever_body_m @ dcm_body_from_ecef,
        centre_mps[..., None, :] + lever_body_m @ turning,
        boresight_body @ dcm_body_from_ecef,
    )


def cross_matrix(vectors: F64) -> F64:
    """Matrices (..., 3, 3) that multiply by vectors (..., 3) crosswise from the left."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    out = np.zeros((*x.shape, 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out
