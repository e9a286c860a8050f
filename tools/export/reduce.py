"""All antennas' measurements as those of one antenna in the centre of mass.

The reduction is that of RU 2654321 (the prototype of RU 2706636), with the flight software's own geometry:
what differs is the way from the antenna and the way from the centre of mass, both by the fix and the
attitude on the bus. A fix 100 m off turns the line of sight by 5e-6 rad, 13 um over a lever of 2.6 m.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternions
from gnss_hil.flightsw.measurement import range_model
from gnss_hil.flightsw.orbit.earth import ROTATION_RPS
from gnss_hil.tools.export.codes import codes_of
from gnss_hil.tools.export.run_data import Array, CraftData, Rows


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """Rows (k,) of the centre of mass, sorted by epoch and satellite.

    unplaced   epochs left out: no fix, or no attitude
    repeated   measurements left out: of a satellite's several the one in the fix counts, then the strongest
    """

    rows: Rows
    unplaced: int
    repeated: int


def one_clock(data: CraftData) -> bool:
    """Whether all receivers that measure run on one oscillator and tell the same time."""
    rows = data.rows[data.tagged]
    epoch = rows.epoch
    domains, offset_ns = data.domain[epoch, rows.receiver], data.tag_offset_ns[epoch, rows.receiver]
    begins = np.flatnonzero(np.r_[True, epoch[1:] != epoch[:-1]]) if len(epoch) else np.zeros(0, int)
    if not len(begins):
        return True
    apart = np.maximum.reduceat(offset_ns, begins) - np.minimum.reduceat(offset_ns, begins)
    return len(np.unique(domains)) == 1 and not apart.any()


def reduced(data: CraftData, shapiro: bool) -> Reduced:
    """Measurements as an antenna in the centre of mass would have made them.

    shapiro   leave the relativistic delay of the path in (True), as a receiver measures it, or take it out
    """
    every = data.rows
    located: Bool = np.isfinite(np.hstack((data.position_m, data.quaternion)).sum(axis=1))
    placed = every[located[every.epoch] & data.tagged]
    rows = distinct(placed)
    lever_m, lever_mps = _levers(data, rows)
    centre_m, centre_mps = data.position_m[rows.epoch], data.velocity_mps[rows.epoch]
    antenna = range_model.rays(rows.pos_sv_m.T, (centre_m + lever_m).T)
    centre = range_model.rays(rows.pos_sv_m.T, centre_m.T)
    nearer_m = centre.range_m - antenna.range_m
    if not shapiro:
        away_m = np.linalg.norm(centre.pos_sv_m.T - centre_m, axis=1)
        nearer_m = nearer_m - range_model.shapiro_m(centre.pos_sv_m, centre_m.T, away_m)
    # d|p - x|/dt seen from both places; the satellite's motion in the axes of reception.
    approach = rows.vel_sv_mps - centre_mps
    rate_mps = np.einsum("ik,ki->k", centre.los - antenna.los, approach) + np.einsum(
        "ik,ki->k", antenna.los, lever_mps
    )
    moved = replace(
        rows,
        pseudorange_m=rows.pseudorange_m + nearer_m,
        range_rate_mps=rows.range_rate_mps + rate_mps,
        phase_cyc=rows.phase_cyc + nearer_m / codes_of(rows).wave_m,
    )
    measured = np.unique(every.epoch)
    return Reduced(moved, int((~located[measured]).sum()), len(placed) - len(rows))


def distinct(rows: Rows) -> Rows:
    """One row for each epoch, satellite and signal: the one in the fix, then the strongest."""
    order = np.lexsort((-rows.cn0_dbhz, ~rows.used, rows.signal, rows.sat, rows.epoch))
    key = np.stack((rows.epoch, rows.sat, rows.signal), axis=-1)[order]
    new = np.ones(len(order), bool)
    new[1:] = (key[1:] != key[:-1]).any(axis=1)
    return rows[order[new]]


def _levers(data: CraftData, rows: Rows) -> tuple[Array, Array]:
    """(k, 3) places of the rows' antennas relative to the centre of mass, ECEF, and their rates."""
    q = data.quaternion
    dcm = dcm_of_quaternions(q / np.linalg.norm(q, axis=1, keepdims=True))[rows.epoch]
    lever = data.vehicle.lever_arm_body_m[rows.receiver]
    turn = np.nan_to_num(data.rate_body_rps[rows.epoch]) - ROTATION_RPS * dcm[:, :, 2]
    place, rate = (np.einsum("kji,kj->ki", dcm, v) for v in (lever, np.cross(turn, lever)))
    return place, rate
