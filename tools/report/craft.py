"""What a report draws of one craft, gathered from its bus, its truth and its channel table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.report.channels import Channels, Strength, read_channels
from gnss_hil.tools.report.frames import covariance, radial_along_cross, sigmas_along
from gnss_hil.tools.report.sky_plot import Sightings, instants, look, places
from gnss_hil.tools.report.tracking_arcs import Holds, bridged, holds, joined
from gnss_hil.tools.results.outages import Stretches, stretches

Columns = Mapping[str, NDArray]

_MOST_HOLDS = 5000
"""Stretches that a browser draws with ease."""


@dataclass(frozen=True, slots=True, eq=False)
class Craft:
    """One craft's run on its time marks, (e,) rows; nan where there is nothing.

    position_m                 (e, 3) of valid fixes, ECEF
    here_m                     (e, 3) the same, by truth where there is no fix
    visible                    (e,) satellites in view as truth has it; this and errors None without truth
    error_m, sigma_m           (e, 3) radial, along, cross; sigma by the flight software's covariance
    counts                     satellites_used, pdop, pdop_distinct, bits, faults: (e,) each
    holds, strength, sightings None where no channels were kept
    bridge_ns                  breaks up to this long are not drawn in `holds`
    handed                     handovers: (t_ns, satellite, receiver before, after)
    handed_out                 whether satellites were commanded at all
    without_fix                stretches of epochs without a fix
    """

    name: str
    vehicle: Vehicle
    interval_ns: int
    t_ns: I64
    position_m: F64
    here_m: F64
    visible: F64 | None
    error_m: F64 | None
    sigma_m: F64 | None
    counts: dict[str, F64]
    holds: Holds | None
    bridge_ns: int
    strength: dict[int, Strength] | None
    sightings: Sightings | None
    handed: list[tuple[int, int, int, int]]
    handed_out: bool
    without_fix: Stretches


def gather(
    name: str, vehicle: Vehicle, interval_s: float, digest: Digest, rows: np.ndarray, channels: Path | None
) -> Craft:
    """rows: truth of this craft, empty if there is none; channels: channels.parquet, None if not kept."""
    timeline = digest.timeline
    t_ns, first = np.unique(timeline.get("t_ns", np.zeros(0, np.int64)), return_index=True)
    interval_ns = round(interval_s * 1e9)
    fixes = _on(t_ns, digest.fixes)
    position = np.where(fixes["valid"][:, None] == 1, _vectors(fixes, "{}_m"), np.nan)
    counts = {k: np.where(fixes["valid"] == 1, fixes[k], np.nan) for k in _COUNTS}
    counts |= {k: _column(timeline, k)[first].astype(float) for k in ("bits", "faults")}
    here, visible, error, sigma = position, None, None, None
    if len(rows):
        truth_m, truth_mps, visible = _truth_on(t_ns, rows)
        here = np.where(np.isnan(position), truth_m, position)
        axes = radial_along_cross(truth_m, truth_mps)
        error = np.einsum("nij,nj->ni", axes, position - truth_m)
        rho = np.column_stack([fixes[f"rho_{pair}"] for pair in ("xy", "xz", "yz")])
        reported = sigmas_along(axes, covariance(_vectors(fixes, "sigma_{}_m"), rho))
        sigma = np.where(np.isnan(error), np.nan, reported)
    quaternion = np.column_stack([_column(timeline, f"q{i}")[first] for i in range(4)])
    looks = instants(np.isfinite(np.column_stack([here, quaternion]).sum(axis=1)))
    held, bridge, strength, sightings = None, 0, None, None
    if channels is not None:
        table = read_channels(channels, name, t_ns, looks)
        held, bridge = _bridged(table, vehicle.antennas, interval_ns)
        strength = table.strength(vehicle.antennas)
        own = table.seen_by <= vehicle.antennas
        pose = t_ns[looks], here[looks], quaternion[looks], vehicle.boresight_body
        sightings = look(*pose, table.seen[own], table.seen_by[own], places(digest.almanac.rows))
    return Craft(
        name=name, vehicle=vehicle, interval_ns=interval_ns, t_ns=t_ns, position_m=position, here_m=here,
        visible=visible, error_m=error, sigma_m=sigma, counts=counts, holds=held, bridge_ns=bridge,
        strength=strength, sightings=sightings, handed=digest.commands.handed,
        handed_out=digest.commands.commands > 0, without_fix=stretches(t_ns, digest.fixes, interval_ns),
    )  # fmt: skip


def _column(table: Columns, name: str) -> NDArray:
    return table.get(name, np.zeros(0))


_COUNTS = ("satellites_used", "pdop", "pdop_distinct")
_FIX_COLUMNS = ("valid", *_COUNTS, "x_m", "y_m", "z_m", "sigma_x_m", "sigma_y_m", "sigma_z_m",
                "rho_xy", "rho_xz", "rho_yz")  # fmt: skip


def _on(t_ns: I64, fixes: Columns) -> dict[str, F64]:
    """Columns of fixes (e,) on time marks; nan where none was reported."""
    out = {name: np.full(len(t_ns), np.nan) for name in _FIX_COLUMNS}
    if fixes:
        at = np.searchsorted(t_ns, fixes["t_ns"])
        for name, column in out.items():
            column[at] = fixes[name]
    return out


def _vectors(columns: Columns, pattern: str) -> F64:
    return np.column_stack([columns[pattern.format(axis)] for axis in "xyz"])


def _truth_on(t_ns: I64, rows: np.ndarray) -> list[F64]:
    """Position, velocity and satellites in view on time marks; nan where truth has no row."""
    _, at, there = np.intersect1d(t_ns, rows["t_gps_ns"], return_indices=True)
    columns = []
    for name in ("position_ecef_m", "velocity_ecef_mps", "satellites_visible"):
        column = np.full((len(t_ns), *rows[name].shape[1:]), np.nan)
        column[at] = rows[name][there]
        columns.append(column)
    return columns


def _bridged(table: Channels, receivers: int, interval_ns: int) -> tuple[Holds, int]:
    """Stretches, breaks bridged just long enough that they can be drawn; how long."""
    one_by_one = (holds(*table.tracked(receiver), interval_ns) for receiver in range(1, receivers + 1))
    found, bridge = joined(list(one_by_one)), 0
    while len(found) > _MOST_HOLDS:
        bridge = max(2 * bridge, interval_ns)
        found = bridged(found, bridge)
    return found, bridge
