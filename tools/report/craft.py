"""What a report draws of one craft, gathered from its bus, its truth and its channel table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.report.channels import Channels, Strength, read_channels
from gnss_hil.tools.report.errors import (
    PAIRS,
    ClockErrors,
    Errors,
    Fixes,
    clock_errors,
    position_errors,
    vectors,
    velocity_errors,
)
from gnss_hil.tools.report.frames import radial_along_cross
from gnss_hil.tools.report.residuals import Residuals, residuals
from gnss_hil.tools.report.sky_plot import Sightings, instants, look, places
from gnss_hil.tools.report.tracking_arcs import Holds, bridged, holds, joined
from gnss_hil.tools.results.consistency import clock_of_fix
from gnss_hil.tools.results.outages import Stretches, stretches
from gnss_hil.tools.results.summary import satellites_in_fix, stated
from gnss_hil.tools.results.truth import INTERPOLATED, at

Columns = Mapping[str, NDArray]

_MOST_HOLDS = 5000
"""Stretches that a browser draws with ease."""


@dataclass(frozen=True, slots=True, eq=False)
class Craft:
    """One craft's run on its time marks, (e,) rows; nan where there is nothing.

    position_m                 (e, 3) of valid fixes, ECEF
    here_m                     (e, 3) the same, by truth where there is no fix
    visible                    (e,) satellites in view as truth has it; None without truth, as errors are
    position, velocity, clock  errors of the fixes against truth
    fixes                      columns of the fixes on the marks
    axes                       (e, 3, 3) rows radial, along, cross: by truth, without it by the fixes
    truth_m                    (e, 3) ECEF, None without truth
    quaternion                 (e, 4) body from ECEF, on the bus
    truth_quaternion           (e, 4), None without truth
    counts                     satellites_used, pdop, pdop_distinct, bits, faults: (e,) each; satellites as
                               NAV_STATUS counts them where no NAV_USED came
    listed                     (e,) whether the fix says which channels are in it
    by_antenna                 by receiver: satellites it measured, (e,)
    residuals                  of the ranges at `looked_at` marks
    holds, by_antenna, strength, sightings, residuals are None where no channels were kept
    bridge_ns                  breaks up to this long are not drawn in `holds`
    commands                   the command log's columns (k,): t_ns, event, receiver, ...
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
    position: Errors | None
    velocity: Errors | None
    clock: ClockErrors | None
    fixes: Fixes
    axes: F64
    truth_m: F64 | None
    quaternion: F64
    truth_quaternion: F64 | None
    counts: dict[str, F64]
    listed: Bool
    holds: Holds | None
    bridge_ns: int
    by_antenna: dict[int, F64] | None
    residuals: Residuals | None
    looked_at: int
    strength: dict[int, Strength] | None
    sightings: Sightings | None
    commands: Columns
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
    fixes = {name: np.where(fixes["valid"] == 1, column, np.nan) for name, column in fixes.items()}
    position = vectors(fixes, "{}_m")
    counts = {k: fixes[k] for k in _COUNTS}
    counts["satellites_used"] = satellites_in_fix(fixes["satellites_used"], fixes["satellites"])
    counts["pdop"] = stated(fixes["pdop"])
    counts |= {k: _column(timeline, k)[first].astype(float) for k in ("bits", "faults")}
    here, visible, errors = position, None, (None, None, None)
    truth_m, turned = None, None
    if len(rows):
        truth_m, truth_mps, visible, clock_s, turned = _truth_on(t_ns, rows)
        here = np.where(np.isnan(position), truth_m, position)
        axes = radial_along_cross(truth_m, truth_mps)
        errors = (position_errors(axes, fixes, truth_m), velocity_errors(axes, fixes, truth_mps),
                  clock_errors(fixes, clock_of_fix(fixes, clock_s)))  # fmt: skip
    else:
        axes = radial_along_cross(position, vectors(fixes, "v{}_mps"))
    quaternion = np.column_stack([_column(timeline, f"q{i}")[first] for i in range(4)])
    looks = instants(np.isfinite(np.column_stack([here, quaternion]).sum(axis=1)))
    held, bridge, strength, sightings = None, 0, None, None
    by_antenna, left, looked_at = None, None, 0
    if channels is not None:
        table = read_channels(channels, name, t_ns, looks)
        held, bridge = _bridged(table, vehicle.antennas, interval_ns)
        strength = table.strength(vehicle.antennas)
        several = any(vehicle.other_signals)
        by_antenna = {r: table.satellites_of(r, several) for r in range(1, vehicle.antennas + 1)}
        ranges = table.ranges[table.ranges.receiver <= vehicle.antennas]
        left = residuals(ranges, position, quaternion, vehicle)
        looked_at = table.looked_at
        own = table.seen_by <= vehicle.antennas
        pose = t_ns[looks], here[looks], quaternion[looks], vehicle.boresight_body
        sightings = look(*pose, table.seen[own], table.seen_by[own], places(digest.almanac.rows))
    return Craft(
        name=name, vehicle=vehicle, interval_ns=interval_ns, t_ns=t_ns, position_m=position, here_m=here,
        visible=visible, position=errors[0], velocity=errors[1], clock=errors[2], fixes=fixes, axes=axes,
        truth_m=truth_m, quaternion=quaternion, truth_quaternion=turned, counts=counts,
        listed=~np.isnan(fixes["satellites_used"]), holds=held,
        bridge_ns=bridge, by_antenna=by_antenna, residuals=left, looked_at=looked_at,
        strength=strength, sightings=sightings, handed=digest.commands.handed,
        commands={name: np.array(column) for name, column in digest.commands.events.items()},
        handed_out=digest.commands.commands > 0, without_fix=stretches(t_ns, digest.fixes, interval_ns),
    )  # fmt: skip


def _column(table: Columns, name: str) -> NDArray:
    return table.get(name, np.zeros(0))


_COUNTS = ("satellites_used", "pdop", "pdop_distinct")
_FIX_COLUMNS = (
    "valid", "satellites", *_COUNTS, "clock_bias_m", "clock_domain", "clock_drift_mps", "sigma_clock_bias_m",
    *(f"{a}_m" for a in "xyz"), *(f"v{a}_mps" for a in "xyz"),
    *(f"sigma_{a}_m" for a in "xyz"), *(f"sigma_v{a}_mps" for a in "xyz"),
    *(f"rho_{v}{pair}" for v in ("", "v") for pair in PAIRS),
)  # fmt: skip


def _on(t_ns: I64, fixes: Columns) -> dict[str, F64]:
    """Columns of fixes (e,) on time marks; nan where none was reported."""
    out = {name: np.full(len(t_ns), np.nan) for name in _FIX_COLUMNS}
    if fixes:
        at = np.searchsorted(t_ns, fixes["t_ns"])
        for name, column in out.items():
            column[at] = fixes[name]
    return out


_TRUTH = (
    "position_ecef_m", "velocity_ecef_mps", "satellites_visible", "clock_s", "quaternion_body_from_ecef"
)  # fmt: skip


def _truth_on(t_ns: I64, rows: np.ndarray) -> list[F64]:
    """Columns _TRUTH on time marks; nan where truth is not known, and what is not interpolated where it has
    no row."""
    there = at(t_ns, rows)
    known = {True: there["t_gps_ns"] == t_ns, False: np.isin(t_ns, rows["t_gps_ns"])}
    columns = []
    for name in _TRUTH:
        column = np.full((len(t_ns), *rows[name].shape[1:]), np.nan)
        found = known[name in INTERPOLATED]
        column[found] = there[name][found]
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
