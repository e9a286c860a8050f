"""What a receiver at a given place measures: range and range rate predicted from a satellite's report.

Exact geometry at the antenna's phase centre, not the patent's first-order projection of the lever arm
(RU 2654321 adds (A^T b) . u; at 2.6 m of lever that is 0.2 um short: the two agree, and exact costs nothing).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.orbit.earth import LIGHT_MPS, MU_M3_S2, ROTATION_RPS

_SHAPIRO_M = 2 * MU_M3_S2 / LIGHT_MPS**2

_STRAIGHTEST = 1 - 1e-8
"""A ray as a share of the way by the Earth's centre: of one that passes the Earth it is below 0.999 even from
the Moon. Closer to the centre, where an iterate may be, the delay stays at 0.17 m and within bounds."""


@dataclass(frozen=True, slots=True, eq=False)
class EarthTurn:
    """From the frame of transmission to that of reception, by the angle the Earth has turned since: its
    cosine and sine, (n,) each."""

    cos: F64
    sin: F64

    def __call__(self, v: F64) -> F64:
        """Vectors (3, n) of the frame of transmission in that of reception."""
        x, y = v[0], v[1]
        return np.array((self.cos * x + self.sin * y, self.cos * y - self.sin * x, v[2]))


def dot(a: F64, b: F64) -> F64:
    """(n,) of vectors (3, n)."""
    return np.add.reduce(a * b)


def _norm(v: F64) -> F64:
    return np.sqrt(dot(v, v))


def flight_angle_rad(pos_sv_m: F64, antenna_m: F64) -> F64:
    """(n,) angle the Earth turns during the signal's flight.

    The flight time is geometric; from the pseudorange it would be wrong by the receiver's clock, 41 cm of
    position for each millisecond. First-order Sagnac term on the unrotated distance: right to 1e-4 m of
    range, hence to 1e-10 m of the rotated position.
    """
    sagnac_m = ROTATION_RPS / LIGHT_MPS * (pos_sv_m[0] * antenna_m[1] - pos_sv_m[1] * antenna_m[0])
    return (_norm(pos_sv_m - antenna_m) + sagnac_m) * (ROTATION_RPS / LIGHT_MPS)


def shapiro_m(pos_sv_m: F64, antenna_m: F64, range_m: F64) -> F64:
    """(n,) relativistic delay of the ray in the Earth's field.

    Source: IERS Conventions 2010, 11.1 (gravitational delay), Earth's monopole
    """
    straight = range_m / (_norm(antenna_m) + _norm(pos_sv_m))
    return 2 * _SHAPIRO_M * np.arctanh(np.minimum(straight, _STRAIGHTEST))


@dataclass(frozen=True, slots=True, eq=False)
class Rays:
    """From satellites to antennas, in ECEF of the reception.

    antenna_m   (3, n)
    distance_m  (n,) geometric
    los         (3, n) unit vectors from antenna to satellite
    pos_sv_m    (3, n) satellites at transmission
    turn        the Earth's during the flight
    """

    antenna_m: F64
    distance_m: F64
    los: F64
    pos_sv_m: F64
    turn: EarthTurn

    @property
    def range_m(self) -> F64:
        """(n,) with Shapiro delay."""
        return self.distance_m + shapiro_m(self.pos_sv_m, self.antenna_m, self.distance_m)

    def from_aside(self, step_m: F64) -> Rays:
        """From the same satellites to antennas that are a step (3,) away, by the same turn of the Earth: ten
        metres would change it by 2e-12 rad."""
        return _rays(self.pos_sv_m, self.antenna_m + step_m[:, None], self.turn)


def rays(pos_sv_m: F64, antenna_m: F64) -> Rays:
    """pos_sv_m (3, n) ECEF of the transmission instant; antenna_m (3, n) ECEF of the reception."""
    angle = flight_angle_rad(pos_sv_m, antenna_m)
    turn = EarthTurn(np.cos(angle), np.sin(angle))
    return _rays(turn(pos_sv_m), antenna_m, turn)


def _rays(turned_m: F64, antenna_m: F64, turn: EarthTurn) -> Rays:
    """Both in the frame of the reception."""
    away = turned_m - antenna_m
    distance = _norm(away)
    return Rays(antenna_m, distance, away / distance, turned_m, turn)


def rate_terms(ray: Rays, vel_sv_mps: F64) -> tuple[F64, F64]:
    """Range rate d(rho)/dt = static - gain (u . v_antenna): static (n,) [m/s] and gain (n,) [-].

    Differentiating rho(t) = |R(omega tau) s(t - tau) - a(t)| with tau = rho / c, where p = R s moves by
    -omega z x p for each second that tau grows:
        rho' (1 + u . (R v_s + omega z x p) / c) = u . (R v_s - v_a)
    The rate of the Shapiro delay, 1e-5 m/s, is below the bus's 1e-4 and left out.
    """
    los, pos = ray.los, ray.pos_sv_m
    along = dot(los, ray.turn(vel_sv_mps))
    gain = 1 / (1 + (along + ROTATION_RPS * (los[1] * pos[0] - los[0] * pos[1])) / LIGHT_MPS)
    return along * gain, gain
