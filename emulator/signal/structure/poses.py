"""Poses of a craft's structure in the epochs of a block: where its bodies are, and the sky as they see it.

A structure without joints stands still in body axes: one pose serves for all epochs. One with joints, that
turn or follow the Sun, has a pose in each. Two instants, some milliseconds apart, give rates: of the paths by
way of its faces, and with them of carriers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.signal.geometry import Motion, spin
from gnss_hil.emulator.signal.structure.bodies import Bodies, Structure, bodies_at, moves
from gnss_hil.emulator.signal.structure.shadowing import blocked, stopped
from gnss_hil.emulator.signal.visibility import View

LATER_S = 0.002
"""From one instant to the other: short against any beat. While a craft slews as fast as it may, a reflection
that is tracked alone changes by 6 m/s, a sixteenth of a cycle."""


@dataclass(frozen=True, slots=True, eq=False)
class SightLines:
    """Unit vectors (..., n, 3) to the satellites, body axes, and their rates [1/s] as the turning craft sees
    them."""

    los_body: F64
    rate_body: F64

    def flat(self) -> SightLines:
        """Those of all epochs in one row, (k n, 3)."""
        return SightLines(self.los_body.reshape(-1, 3), self.rate_body.reshape(-1, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A craft's structure and los_body (n, 3) to the satellites at two instants LATER_S apart. With bodies of
    several instants, los_body has the satellites of one after those of another."""

    bodies: Bodies
    los_body: F64
    later: Bodies
    los_later: F64


@dataclass(frozen=True, slots=True, eq=False)
class StructurePoses:
    """A structure in k epochs, seen in body axes.

    pose   of the structure, in each epoch if it moves;  los (k, n, 3) unit vectors to the satellites
    """

    shape: Structure
    vehicle: Vehicle
    pose: Pose
    los: F64

    def hidden(self, candidate: Bool) -> Bool:
        """(k, m, n) which candidates (k, m, n) the structure hides from an antenna."""
        out, arm_m = np.zeros_like(candidate), self.vehicle.lever_arm_body_m
        if moves(self.shape):
            epoch, antenna, row = np.nonzero(candidate)
            out[epoch, antenna, row] = stopped(self.pose.bodies, epoch, arm_m[antenna], self.los[epoch, row])
            return out
        epoch, row = np.nonzero(candidate.any(axis=1))
        out[epoch, :, row] = blocked(self.pose.bodies, arm_m, self.los[epoch, row]).T
        return out & candidate


def los_rate_body(los_body: F64, towards_mps: F64, distance_m: F64, rate_body_rps: F64) -> F64:
    """Rates (..., n, 3) [1/s] of unit vectors los_body (..., n, 3) as the turning craft sees them.

    towards_mps     (..., n, 3) inertial velocities of the targets relative to the craft, body axes [m/s]
    distance_m      (..., n);  rate_body_rps (3,) or (..., 1, 3) of the craft relative to inertial space
                    [rad/s]
    """
    along = (towards_mps * los_body).sum(axis=-1, keepdims=True)
    return (towards_mps - along * los_body) / distance_m[..., None] - np.cross(rate_body_rps, los_body)


def sight_lines(view: View, motion: Motion, state: CraftState, dcm: F64, rate_rps: F64) -> SightLines:
    """From a craft to the satellites in k epochs.

    motion   of the satellites (k, n, 3), inertial;  dcm (k, 3, 3) body from ECEF;  rate_rps (k, 3)
    """
    turn = dcm.swapaxes(-1, -2)
    los = view.los_ecef @ turn
    craft_mps = state.vel_ecef_mps + spin(state.pos_ecef_m)
    towards_mps = (motion.vel_mps - craft_mps[:, None]) @ turn
    return SightLines(los, los_rate_body(los, towards_mps, view.distance_m, rate_rps[:, None]))


def sun_body(dcm: F64, sun_m: F64, state: CraftState) -> F64:
    """Directions (k, 3) of the Sun, body axes.

    dcm   (k, 3, 3) body from ECEF;  sun_m (k, 3) its place in ECEF
    """
    sun = (dcm @ (sun_m - state.pos_ecef_m)[..., None])[..., 0]
    sun /= np.sqrt(np.einsum("kc,kc->k", sun, sun))[:, None]
    return sun


def pose(craft: Structure, sight: SightLines, sun: F64, rate_body_rps: F64, t_s: float | F64) -> Pose:
    """The structure and the sky at t_s (...) after the start and LATER_S on.

    sight                lines (n, 3)
    sun, rate_body_rps   (..., 3) direction of the Sun and rate of the craft, body axes
    """
    moved = sun - LATER_S * np.cross(rate_body_rps, sun)
    return Pose(
        bodies_at(craft, sun, t_s),
        sight.los_body,
        bodies_at(craft, moved, t_s + LATER_S),
        sight.los_body + LATER_S * sight.rate_body,
    )


def poses(
    shape: Structure, vehicle: Vehicle, sight: SightLines, sun: F64, rate_rps: F64, t_s: F64
) -> StructurePoses:
    """A structure in k epochs.

    sight   lines (k, n, 3);  sun, rate_rps (k, 3) as in `pose`;  t_s (k,) since the start of the run
    """
    if moves(shape):
        found = pose(shape, sight.flat(), sun, rate_rps, t_s)
    else:
        found = pose(shape, sight.flat(), sun[0], rate_rps[0], float(t_s[0]))
    return StructurePoses(shape, vehicle, found, sight.los_body)
