"""Structure effects: what a craft's own structure hides, and what its reflections do to signals, in the
epochs of a block.

A structure without joints stands still in body axes: one pose serves for all epochs. One with joints, that
turn or follow the Sun, has a pose in each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.signal import antenna_patterns, multipath_engine
from gnss_hil.emulator.signal.geometry import Motion, angle_rad, spin
from gnss_hil.emulator.signal.multipath_engine import Pose, Reception, Settings
from gnss_hil.emulator.signal.structure.bodies import Structure, moves
from gnss_hil.emulator.signal.structure.shadowing import blocked, stopped
from gnss_hil.emulator.signal.visibility import View


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

    def receive(
        self,
        settings: Settings,
        spacing_chips: float,
        antennas: antenna_patterns.Receive,
        at: I64,
        signals: tuple[I64, I64, F64, F64, F64],
    ) -> Reception:
        """What signals (p,) become by reflections.

        at        (p,) epoch of each
        signals   (p,) each: antenna, satellite, amplitude of the direct ray (1 free, 0 hidden), lengths of
                  carrier wave and code chip [m]
        """
        antenna, satellite, direct, wave_m, chip_m = signals
        # Satellites of all epochs in one row, which is that of the pose.
        flat = at * self.los.shape[1] + satellite
        return multipath_engine.receive(
            self.shape, settings, spacing_chips, self.pose, self.vehicle.lever_arm_body_m, antenna, flat,
            direct, wave_m, chip_m, self._gain_dbi(antennas), at if moves(self.shape) else None,
        )  # fmt: skip

    def _gain_dbi(self, antennas: antenna_patterns.Receive):
        boresight = self.vehicle.boresight_body

        def gain_dbi(rows: I64, towards: F64) -> F64:
            angle = angle_rad(boresight[rows], towards)
            return antenna_patterns.look_up(antennas.right_dbi, antennas.row[rows], angle)

        return gain_dbi


def poses(
    shape: Structure,
    vehicle: Vehicle,
    view: View,
    motion: Motion,
    state: CraftState,
    dcm: F64,
    rate_rps: F64,
    sun_m: F64,
    t_s: F64,
) -> StructurePoses:
    """A structure in k epochs.

    motion   of the satellites (k, n, 3), inertial;  dcm (k, 3, 3) body from ECEF;  rate_rps (k, 3)
    sun_m    (k, 3) place of the Sun in ECEF;  t_s (k,) since the start of the run
    """
    turn = dcm.swapaxes(-1, -2)
    los = view.los_ecef @ turn
    craft_mps = state.vel_ecef_mps + spin(state.pos_ecef_m)
    towards_mps = (motion.vel_mps - craft_mps[:, None]) @ turn
    los_rate = multipath_engine.los_rate_body(los, towards_mps, view.distance_m, rate_rps[:, None])
    sun = (dcm @ (sun_m - state.pos_ecef_m)[..., None])[..., 0]
    sun /= np.sqrt(np.einsum("kc,kc->k", sun, sun))[:, None]
    rows = los.reshape(-1, 3), los_rate.reshape(-1, 3)
    if moves(shape):
        pose = multipath_engine.pose(shape, *rows, sun, rate_rps, t_s)
    else:
        pose = multipath_engine.pose(shape, *rows, sun[0], rate_rps[0], float(t_s[0]))
    return StructurePoses(shape, vehicle, pose, los)
