"""A run as its frames have it: all exports are made from this."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.decoder.block import Columns, GrowingTable
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.recording.run_folder import LOG, SCENARIO, check_run_folder
from gnss_hil.tools.results import assemble
from gnss_hil.tools.results.run_digest import bus_names, feed_log

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Measurements, one row for each channel and epoch; names and conventions of the bus contract.

    epoch     (k,) row of the epochs;  receiver (k,) 0-based;  channel (k,);  sat (k,) satellite index
    signal    (k,) value of the contract's table "Signal"
    pseudorange_m, range_rate_mps, phase_cyc, cn0_dbhz, clock_m   (k,)
    slips, half_cycle, frequency   (k,);  used (k,) in the fix
    pos_sv_m, vel_sv_mps   (k, 3) satellite at transmission, ECEF of that instant
    """

    epoch: Numbers
    receiver: Numbers
    channel: Numbers
    sat: Numbers
    signal: Numbers
    pseudorange_m: Array
    range_rate_mps: Array
    phase_cyc: Array
    cn0_dbhz: Array
    clock_m: Array
    slips: Numbers
    half_cycle: Numbers
    frequency: Numbers
    used: NDArray[np.bool_]
    pos_sv_m: Array
    vel_sv_mps: Array

    def __len__(self) -> int:
        return len(self.epoch)

    def __getitem__(self, rows) -> Rows:
        return Rows(*(getattr(self, f.name)[rows] for f in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class CraftData:
    """One craft.

    t_ns            (e,) time marks, ascending [ns]
    quaternion      (e, 4) body from ECEF, and rate_body_rps (e, 3) relative to inertial space, nan if absent
    position_m, velocity_mps   (e, 3) the fix, centre of mass, ECEF; nan where there is none
    tag_offset_ns   (e, m) receivers' clocks minus mark, nan if absent;  domain (e, m)
    """

    name: str
    vehicle: Vehicle
    t_ns: Numbers
    quaternion: Array
    rate_body_rps: Array
    position_m: Array
    velocity_mps: Array
    tag_offset_ns: Array
    domain: Numbers
    rows: Rows

    @property
    def tagged(self) -> NDArray[np.bool_]:
        """(k,) rows of a receiver whose clock was reported at their epoch."""
        return ~np.isnan(self.tag_offset_ns[self.rows.epoch, self.rows.receiver])

    def tag_ns(self, epoch: Numbers, receiver: Numbers) -> Numbers:
        """What a receiver's clock showed at an epoch's mark [ns]; the tag must have been reported."""
        return self.t_ns[epoch] + np.rint(self.tag_offset_ns[epoch, receiver]).astype(np.int64)


_AXES = ("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps")
_ROW_NAMES = {
    "pseudorange_m": float, "range_rate_mps": float, "phase_cyc": float, "cn0_dbhz": float, "clock_m": float,
    "slips": int, "half_cycle": int, "frequency": int, "sat": int, "signal": int, "channel": int,
    "receiver": int, "used": bool, "t_ns": np.int64, **dict.fromkeys(_AXES, float),
}  # fmt: skip


def read(folder: Path) -> tuple[Scenario, list[CraftData]]:
    """The scenario of a run folder and what each craft's bus carried; Mistake where it is no run folder."""
    check_run_folder(folder)
    if not (folder / LOG).is_file():
        raise Mistake(f"{folder}: has no {LOG}; a run without a log (--no-log) cannot be exported")
    scenario, codecs = assemble.read_scenario(folder)
    path = folder / SCENARIO
    vehicles = [vehicle.load(scenarios.vehicle_path(craft, path)) for craft in scenario.craft]
    names = [craft.name for craft in scenario.craft]
    tables = [GrowingTable() for _ in names]
    digests = [Digest(codec, table.add) for codec, table in zip(codecs, tables, strict=True)]
    feed_log(folder / LOG, bus_names(names), lambda bus, frames: digests[bus].feed(frames))
    for digest in digests:
        digest.finish()
    return scenario, [
        _craft_data(folder, name, v, digest, table.rows)
        for name, v, digest, table in zip(names, vehicles, digests, tables, strict=True)
    ]


def scenario_of(folder: Path) -> Scenario:
    """The scenario of a run folder, with a log or without; Mistake where it is no run folder."""
    check_run_folder(folder)
    return assemble.read_scenario(folder)[0]


def _craft_data(folder: Path, name: str, craft: Vehicle, digest: Digest, channels: Columns) -> CraftData:
    timeline = digest.timeline
    if not timeline or not len(timeline["t_ns"]):
        raise Mistake(f"{folder / LOG}: nothing was heard of craft {name}: no time mark")
    t_ns = timeline["t_ns"]
    if (np.diff(t_ns) <= 0).any():
        raise Mistake(f"{folder / LOG}: craft {name}: time goes back: several runs in one recording")
    fixes, epochs = digest.fixes, len(t_ns)
    motion = np.full((epochs, 6), np.nan)
    at = np.searchsorted(t_ns, fixes["t_ns"][fixes["valid"]])
    motion[at] = np.stack([fixes[axis][fixes["valid"]] for axis in _AXES], axis=-1)
    tags = digest.tags.rows
    tag_at = np.searchsorted(t_ns, tags["t_ns"]), tags["receiver"] - 1
    offset_ns = np.full((epochs, craft.antennas), np.nan)
    domain = np.zeros(offset_ns.shape, np.int64)
    offset_ns[tag_at], domain[tag_at] = tags["tag_offset_ns"], tags["clock_domain"]
    return CraftData(
        name=name,
        vehicle=craft,
        t_ns=t_ns,
        quaternion=np.stack([timeline[f"q{i}"] for i in range(4)], axis=-1),
        rate_body_rps=np.stack([timeline[f"w{axis}_rps"] for axis in "xyz"], axis=-1),
        position_m=motion[:, :3],
        velocity_mps=motion[:, 3:],
        tag_offset_ns=offset_ns,
        domain=domain,
        rows=_rows(t_ns, channels),
    )


def _rows(t_ns: Numbers, channels: Columns) -> Rows:
    """The channel table, sorted by epoch and satellite."""
    columns = {name: np.asarray(channels.get(name, ()), kind) for name, kind in _ROW_NAMES.items()}
    epoch = np.searchsorted(t_ns, columns.pop("t_ns"))
    motion = [columns.pop(axis) for axis in _AXES]
    columns["receiver"] = columns["receiver"] - 1
    position, velocity = (np.stack(axes, axis=-1) for axes in (motion[:3], motion[3:]))
    rows = Rows(epoch=epoch, pos_sv_m=position, vel_sv_mps=velocity, **columns)
    return rows[np.lexsort((rows.receiver, rows.sat, rows.epoch))]
