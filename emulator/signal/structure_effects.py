"""Structure effects: what a craft's own structure hides, and what its reflections do to signals, in the
epochs of a block.

A structure without joints stands still in body axes: its epochs are worked out together. One with joints,
that turn or follow the Sun, is another structure in each epoch.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.signal import antenna_patterns, multipath_engine
from gnss_hil.emulator.signal.geometry import Motion, angle_rad, spin
from gnss_hil.emulator.signal.multipath_engine import Pose, Reception, Settings
from gnss_hil.emulator.signal.structure.bodies import Structure
from gnss_hil.emulator.signal.structure.shadowing import blocked
from gnss_hil.emulator.signal.visibility import View


@dataclass(frozen=True, slots=True, eq=False)
class StructurePoses:
    """A structure in k epochs, seen in body axes.

    los            (k, n, 3) unit vectors to the satellites;  los_rate (k, n, 3) [1/s]
    sun            (k, 3) unit vectors to the Sun;  rate_rps (k, 3) of the craft
    t_s            (k,) since the start of the run [s]
    """

    shape: Structure
    vehicle: Vehicle
    los: F64
    los_rate: F64
    sun: F64
    rate_rps: F64
    t_s: F64

    def hidden(self, candidate: Bool) -> Bool:
        """(k, m, n) which candidates (k, m, n) the structure hides from an antenna."""
        out = np.zeros_like(candidate)
        for epochs in self._groups():
            epoch, row = np.nonzero(candidate[epochs].any(axis=1))
            los = self.los[epochs][epoch, row]
            bodies = self._pose(epochs).bodies
            shadow = np.zeros_like(candidate[epochs])
            shadow[epoch, :, row] = blocked(bodies, self.vehicle.lever_arm_body_m, los).T
            out[epochs] = shadow & candidate[epochs]
        return out

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
        out = np.zeros((4, len(at)))
        for epochs in self._groups():
            mine = np.flatnonzero((at >= epochs.start) & (at < epochs.stop))
            if not len(mine):
                continue
            # Satellites of all epochs in one row, which is that of `_pose`.
            flat = (at[mine] - epochs.start) * self.los.shape[1] + satellite[mine]
            found = multipath_engine.receive(
                self.shape, settings, spacing_chips, self._pose(epochs), self.vehicle.lever_arm_body_m,
                antenna[mine], flat, direct[mine], wave_m[mine], chip_m[mine], self._gain_dbi(antennas),
            )  # fmt: skip
            out[:, mine] = found.range_m, found.phase_m, found.rate_mps, found.level_db
        return Reception(*out)

    def _groups(self) -> Iterator[slice]:
        """Epochs in which the structure is the same."""
        still = not (self.shape.joint >= 0).any()
        length = len(self.t_s) if still else 1
        return (slice(k, k + length) for k in range(0, len(self.t_s), length))

    def _pose(self, epochs: slice) -> Pose:
        return multipath_engine.pose(
            self.shape, self.los[epochs].reshape(-1, 3), self.los_rate[epochs].reshape(-1, 3),
            self.sun[epochs.start], self.rate_rps[epochs.start], float(self.t_s[epochs.start]),
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
    return StructurePoses(shape, vehicle, los, los_rate, sun, rate_rps, t_s)
