"""From geometry to C/N0: the link budget of a craft, as rich as its models make it.

Without any model of the stage LINK it is that of `gnss_hil.emulator.signal.simple_link_budget`. One model
brings the full budget, in which what the others would give is taken from the same plain model: isotropic
transmitters at the promised power, a receive pattern linear in the cosine, one noise temperature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.error_models.base import LinkTerm
from gnss_hil.emulator.signal import antenna_patterns, frontend, jamming, link_budget, simple_link_budget
from gnss_hil.emulator.signal.antenna_patterns import Receive
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry
from gnss_hil.emulator.signal.jamming import Jammers
from gnss_hil.emulator.signal.link_budget import Budget


@dataclass(frozen=True, slots=True)
class PlainReceiver:
    """Gain of the antennas at boresight and at 90 deg [dBi], system noise temperature [K]."""

    gain_dbi: float
    gain_at_90deg_dbi: float
    noise_temperature_k: float


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A craft's reception; budget None: the simple one. antennas: patterns that are in force either way."""

    plain: PlainReceiver
    antennas: Receive
    budget: Budget | None
    jammers: Jammers | None


def build_link(plain: PlainReceiver, antennas: int, term: LinkTerm | None) -> Link:
    """The link of a craft with m antennas and what its models give, None without any."""
    pattern = antenna_patterns.cosine_law(plain.gain_dbi, plain.gain_at_90deg_dbi)
    by_law = antenna_patterns.receive((pattern,) * antennas, 0.0)
    if term is None:
        return Link(plain, by_law, None, None)
    receive = by_law if term.antennas is None else term.antennas
    noise_wphz = (
        frontend.density_wphz(plain.noise_temperature_k) if term.noise_wphz is None else term.noise_wphz
    )
    budget = Budget(
        link_budget.isotropic() if term.transmitters is None else term.transmitters,
        receive,
        noise_wphz,
        0.0 if term.loss_db is None else term.loss_db,
    )
    return Link(plain, receive, budget, term.jammers)


def cn0_dbhz(link: Link, at: EpochGeometry, epoch: I64, row: I64, signal: I64) -> F64:
    """Carrier to noise density (m, s) [dBHz] of signals, by their values on the bus, of satellites `row` in
    epochs `epoch` of a block, (s,) each, at every antenna, nothing in the way."""
    index, distance_m = at.sky.index[row], at.view.distance_m[epoch, row]
    angle_rad = at.view.angle_rad[epoch, :, row].T
    if link.budget is None:
        plain = link.plain
        return simple_link_budget.cn0_dbhz(
            signal, distance_m, angle_rad,
            plain.gain_dbi, plain.gain_at_90deg_dbi, plain.noise_temperature_k,
        )  # fmt: skip
    off_nadir = link_budget.off_nadir_rad(at.sky.pos_ecef_m[epoch, row], at.state.pos_ecef_m[epoch])
    return link_budget.cn0_dbhz(
        link.budget, signal, index, off_nadir, distance_m, angle_rad,
        _jamming_wphz(link, at, epoch, row, signal),
    )  # fmt: skip


def _jamming_wphz(link: Link, at: EpochGeometry, epoch: I64, row: I64, signal: I64) -> F64 | float:
    if link.jammers is None or link.budget is None:
        return 0.0
    out = np.empty((at.antennas.boresight.shape[1], len(row)))
    for k in range(len(at)):
        mine = epoch == k
        arrival = jamming.arrivals(
            link.jammers, at.state.pos_ecef_m[k], at.dcm_body_from_ecef[k], int(at.t_ns[k])
        )
        frequency = at.sky.broadcast.frequency[k, row[mine]]
        overlaps = jamming.overlaps_perhz(link.jammers, signal[mine], frequency)
        out[:, mine] = jamming.density_wphz(arrival, link.budget.antennas, at.antennas.boresight[k], overlaps)
    return out
