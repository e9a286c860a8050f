"""Where a craft is: its equations of motion, solved straight into piecewise polynomials.

Each segment is solved by Picard iteration on Chebyshev nodes, so the table that is read every epoch *is*
the solution: no step control, no dense output between steps. A one-minute segment contracts by about
(n h)^2 / 8 = 6e-4 per iteration in low orbit and ends at rounding.
Source: Bai & Junkins, "Modified Chebyshev-Picard Iteration Methods for Orbit Propagation",
J. Astronautical Sciences 58, 2011.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.config import tables as scenario
from gnss_hil.emulator.earth.constants import (
    EQUATORIAL_RADIUS_M,
    MU_M3PS2,
    ROTATION_RPS,
    eci_to_ecef,
    rotation_angle_rad,
)
from gnss_hil.emulator.numerics.chebyshev import NS_PER_S, Grid, Table, lobatto_nodes
from gnss_hil.emulator.orbits import forces

_SEGMENT_NS = 60 * NS_PER_S
"""Of orbits that come below some 5000 km; higher ones take longer ones."""

_LONGEST = 5
"""What higher ones multiply it by, at most: a passage into the shadow takes 2 min in a geosynchronous orbit,
and five of its thirteen nodes must fall into it."""

_HIGH_M = 7.4e6
"""Perigee from which segments grow, as the time does in which an orbit bends by an angle."""

_DEGREE = 12
_PER_CHUNK = 30
_CONVERGED_ULP = 8
_MOST_ITERATIONS = 40
_LOWEST_PERIGEE_KM = 100.0

_HIGHEST_APOGEE_KM = 101_000.0
"""The bus ends at 109.95e6 m from the Earth's centre (NAV_X, NAV_Y, NAV_Z): 2.4 % above this. Elements given
over a pole at the lowest perigee leave out the energy of J2 there, and their apogee grows by 2.0 %."""


class OrbitError(ArithmeticError):
    """The orbit cannot be continued: the craft is inside the Earth or the solution diverges."""


@dataclass(frozen=True, slots=True, eq=False)
class CraftState:
    """Centre of mass of a craft at one instant or at q of them, (3,) or (q, 3) each, in WGS-84 ECEF axes of
    the instant, relative to them.

    pos_ecef_m      [m]
    vel_ecef_mps    [m/s]
    acc_ecef_mps2   [m/s^2], second time derivative of pos_ecef_m
    """

    pos_ecef_m: F64
    vel_ecef_mps: F64
    acc_ecef_mps2: F64


class Orbit:
    """The orbit of one craft, any instant before or after its start."""

    def __init__(
        self, start_ns: int, pos_eci_m: F64, vel_eci_mps: F64, acceleration, segment_ns: int = _SEGMENT_NS
    ):
        self.start_ns = start_ns
        self._segment_ns = segment_ns
        self.acceleration = acceleration
        self.leap_s = gpstime.leap_seconds(start_ns)
        # States at the chunk boundaries met so far; each follows from its neighbour towards the start.
        self._boundary = {0: (pos_eci_m, vel_eci_mps)}
        self._table = Table(Grid(start_ns, segment_ns, 0, _DEGREE, _PER_CHUNK), self._sample)

    def at(self, t_ns: int) -> CraftState:
        """State at GPS time t_ns."""
        return CraftState(*self._table.at(t_ns))

    def over(self, t_ns: I64) -> CraftState:
        """States (q, 3) at GPS times (q,)."""
        return CraftState(*self._table.over(t_ns).swapaxes(0, 1))

    def _sample(self, chunk: int) -> F64:
        """Positions (per_chunk, nodes, 3), ecef [m], at the nodes of a chunk's segments."""
        positions, end = self._solve(chunk, forward=True)
        self._boundary.setdefault(chunk + 1, end)
        grid = self._table.grid
        # From the middles on, the angle runs in seconds: a node rounded to 1 ns would be 0.5 um off.
        middles = rotation_angle_rad(grid.middles_ns(chunk), self.leap_s)
        return eci_to_ecef(positions, middles[:, None] + ROTATION_RPS * grid.nodes_s)

    def _state_at_boundary(self, chunk: int) -> tuple[F64, F64]:
        """Position and velocity, eci, where a chunk begins."""
        step = 1 if chunk > 0 else -1
        known = chunk
        while known not in self._boundary:
            known -= step
        while known != chunk:
            _, end = self._solve(known if step > 0 else known - 1, forward=step > 0)
            known += step
            self._boundary[known] = end
        return self._boundary[chunk]

    def _solve(self, chunk: int, forward: bool) -> tuple[F64, tuple[F64, F64]]:
        """Solve a chunk from its beginning (or, backward, from its end).

        returns  positions (s, k, 3) eci [m] at the nodes in solving order, and the state at the end
        """
        h_s = (1 if forward else -1) * self._segment_ns / NS_PER_S / 2
        state = self._state_at_boundary(chunk if forward else chunk + 1)
        boundary_ns = self.start_ns + (chunk if forward else chunk + 1) * _PER_CHUNK * self._segment_ns
        positions = np.empty((_PER_CHUNK, _DEGREE + 1, 3))
        nodes_ns = np.rint((lobatto_nodes(_DEGREE) + 1) * h_s * NS_PER_S).astype(np.int64)
        for row in range(_PER_CHUNK):
            times_ns = boundary_ns + row * round(2 * h_s * NS_PER_S) + nodes_ns
            positions[row], state = solve_segment(times_ns, *state, h_s, self.acceleration)
        return positions, state


def _integration_matrices(degree: int) -> tuple[F64, F64]:
    """Matrices (k, k) that turn values at the Lobatto nodes into first and second integrals from x = -1."""
    nodes = lobatto_nodes(degree)
    once, twice = np.empty((2, degree + 1, degree + 1))
    for j, row in enumerate(np.eye(degree + 1)):
        coefficients = np.linalg.solve(chebyshev.chebvander(nodes, degree), row)
        once[:, j] = chebyshev.chebval(nodes, chebyshev.chebint(coefficients, lbnd=-1))
        twice[:, j] = chebyshev.chebval(nodes, chebyshev.chebint(coefficients, m=2, lbnd=-1))
    return once, twice


_ONCE, _TWICE = _integration_matrices(_DEGREE)


def solve_segment(
    times_ns: I64, pos_m: F64, vel_mps: F64, h_s: float, acceleration
) -> tuple[F64, tuple[F64, F64]]:
    """Solve the motion over one segment from its first node.

    times_ns  (k,) GPS times of the nodes [ns]
    pos_m     (3,) position and
    vel_mps   (3,) velocity at the first node, eci
    h_s       half the segment [s]; negative runs back in time
    returns   positions at the nodes (k, 3) [m], and position and velocity at the last node
    """
    drift_m = pos_m + np.outer((lobatto_nodes(_DEGREE) + 1) * h_s, vel_mps)
    # Velocities at the nodes serve velocity-dependent forces only; they converge with the positions.
    positions, velocities = drift_m, np.broadcast_to(vel_mps, drift_m.shape)
    converged_m = _CONVERGED_ULP * np.spacing(np.linalg.norm(pos_m))
    for _ in range(_MOST_ITERATIONS):
        acc = acceleration(times_ns, positions, velocities)
        before = positions
        positions = drift_m + h_s * h_s * (_TWICE @ acc)
        velocities = vel_mps + h_s * (_ONCE @ acc)
        if np.abs(positions - before).max() < converged_m:
            return positions, (positions[-1], velocities[-1])
    near = gpstime.iso(int(times_ns[0]))
    raise OrbitError(f"no solution near {near}: the orbit meets the Earth, or air too dense to fly in")


def semi_major_axis_m(orbit: scenario.Orbit) -> float:
    """Semi-major axis [m]: given, or an altitude above the equatorial radius."""
    if orbit.semi_major_axis_km is not None:
        return 1e3 * orbit.semi_major_axis_km
    assert orbit.altitude_km is not None, "the scenario's model wants one of the two"
    return EQUATORIAL_RADIUS_M + 1e3 * orbit.altitude_km


def state_of_elements(orbit: scenario.Orbit) -> tuple[F64, F64]:
    """Position [m] and velocity [m/s], (3,) each, eci, of osculating elements.

    Source: Montenbruck & Gill, Satellite Orbits, 2.2 (eqs. 2.43 to 2.51)
    """
    raan, perigee, inclination, anomaly = np.deg2rad(
        [orbit.raan_deg, orbit.arg_perigee_deg, orbit.inclination_deg, orbit.true_anomaly_deg]
    )
    cos_i, sin_i = np.cos(inclination), np.sin(inclination)
    node = np.array([np.cos(raan), np.sin(raan), 0.0])
    across = np.array([-cos_i * np.sin(raan), cos_i * np.cos(raan), sin_i])
    p_hat = np.cos(perigee) * node + np.sin(perigee) * across
    q_hat = np.cos(perigee) * across - np.sin(perigee) * node
    semi_latus_m = semi_major_axis_m(orbit) * (1 - orbit.eccentricity**2)
    r_m = semi_latus_m / (1 + orbit.eccentricity * np.cos(anomaly))
    speed = np.sqrt(MU_M3PS2 / semi_latus_m)
    pos = r_m * (np.cos(anomaly) * p_hat + np.sin(anomaly) * q_hat)
    vel = speed * ((orbit.eccentricity + np.cos(anomaly)) * q_hat - np.sin(anomaly) * p_hat)
    return pos, vel


def build_orbit(orbit: scenario.Orbit, start_ns: int) -> Orbit:
    """The orbit a scenario describes, starting at GPS time start_ns.

    ScenarioError if it meets the Earth, or goes where the bus has no coordinates for it.
    """
    perigee_km, apogee_km = (
        (semi_major_axis_m(orbit) * (1 + way * orbit.eccentricity) - EQUATORIAL_RADIUS_M) / 1e3
        for way in (-1, 1)
    )
    if perigee_km < _LOWEST_PERIGEE_KM:
        raise scenario.ScenarioError(
            f"craft.orbit: perigee at {perigee_km:.0f} km; allowed is {_LOWEST_PERIGEE_KM:.0f} km and above"
        )
    if apogee_km > _HIGHEST_APOGEE_KM:
        raise scenario.ScenarioError(
            f"craft.orbit: apogee at {apogee_km:.0f} km; allowed is {_HIGHEST_APOGEE_KM:.0f} km and below"
        )
    return Orbit(
        start_ns, *state_of_elements(orbit), forces.total(orbit, start_ns), _segment_ns(1e3 * perigee_km)
    )


def _segment_ns(perigee_m: float) -> int:
    """Length of the segments [ns] of an orbit whose perigee is this high."""
    bend = ((EQUATORIAL_RADIUS_M + perigee_m) / _HIGH_M) ** 1.5
    return min(max(1, int(bend)), _LONGEST) * _SEGMENT_NS
