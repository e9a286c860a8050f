"""Epoch geometry: where a craft, its antennas and the satellites are in the epochs of a block.

An axis of epochs k comes first, then antennas m or satellites n. Nothing here depends on commands.
"""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.constellation.sky import SkyState
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.signal.geometry import Antennas, Motion
from gnss_hil.emulator.signal.structure.poses import StructurePoses
from gnss_hil.emulator.signal.visibility import View


@dataclass(frozen=True, slots=True, eq=False)
class EpochGeometry:
    """One craft in k epochs.

    epoch        (k,) numbers of the epochs, one after another
    mark_ns      (k,) time marks;  t_ns (k,) GPS times at which the receivers latch [ns]
    ahead_s      (k,) mark minus latch [s]
    clock        (k, 2, 8) receiver clocks minus GPS time [s] and their rates [s/s], by clock domain
    sky, motion  satellites at the latch, and their inertial motion, (k, n, ...)
    state        centre of mass at the latch, (k, 3) each
    quaternion   (k, 4) body from ECEF;  dcm (k, 3, 3) the same;  rate_body_rps (k, 3) relative to inertial
                 space
    antennas     (k, m, 3) each
    view         directions (k, n), angles (k, m, n)
    sun_ecef_m   (k, 3)
    structure    the craft's structure in these epochs, None where no model needs it
    """

    epoch: I64
    mark_ns: I64
    t_ns: I64
    ahead_s: F64
    clock: F64
    sky: SkyState
    motion: Motion
    state: CraftState
    quaternion: F64
    dcm_body_from_ecef: F64
    rate_body_rps: F64
    antennas: Antennas
    view: View
    sun_ecef_m: F64
    structure: StructurePoses | None

    def __len__(self) -> int:
        return len(self.epoch)
