"""What a report draws of one craft, gathered from its bus, its truth and its channel table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.report.channels import Channels, Strength, read_channels
from gnss_hil.tools.report.frames import covariance, radial_along_cross, sigmas_along
from gnss_hil.tools.report.sky_plot import Places, Sightings, instants, look, places
from gnss_hil.tools.report.tracking_arcs import Holds, bridged, holds, joined

_MOST_HOLDS = 5000
"""Stretches that a browser draws with ease."""


@dataclass(frozen=True, slots=True, eq=False)
class Craft:
    """One craft's run on its time marks, (e,) rows; nan where there is nothing.

    position_m, velocity_mps   (e, 3) of valid fixes, ECEF
    truth_m, truth_mps         (e, 3); None where no truth was kept
    visible                    (e,) satellites in view as truth says
    error_m, sigma_m           (e, 3) radial, along, cross; sigma by the flight software's covariance
    counts                     satellites_used, measurements, pdop, pdop_distinct, bits, faults: (e,) each
    quaternion                 (e, 4) body from ECEF, as on the bus
    holds, strength, sightings None where no channels were kept
    bridge_ns                  breaks up to this long are not drawn in `holds`
    handed                     handovers: (t_ns, satellite, receiver before, after)
    """

    name: str
    vehicle: Vehicle
    interval_ns: int
    t_ns: NDArray[np.int64]
    position_m: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]
    truth_m: NDArray[np.float64] | None
    truth_mps: NDArray[np.float64] | None
    visible: NDArray[np.float64] | None
    error_m: NDArray[np.float64] | None
    sigma_m: NDArray[np.float64] | None
    counts: dict[str, NDArray[np.float64]]
    quaternion: NDArray[np.float64]
    holds: Holds | None
    bridge_ns: int
    strength: dict[int, Strength] | None
    sightings: Sightings | None
    handed: list[tuple[int, int, int, int]]

    @property
    def here_m(self) -> NDArray[np.float64]:
        """(e, 3) the fix, or the truth where there is none."""
        if self.truth_m is None:
            return self.position_m
        return np.where(np.isnan(self.position_m), self.truth_m, self.position_m)


def gather(
    name: str, vehicle: Vehicle, interval_s: float, digest: Digest, rows: np.ndarray, channels: Path | None
) -> Craft:
    """rows: truth of this craft, empty if there is none; channels: channels.parquet, None if not kept."""
    timeline = digest.timeline
    t_ns, first = np.unique(timeline.get("t_ns", np.zeros(0, np.int64)), return_index=True)
    interval_ns = round(interval_s * 1e9)
    quaternion = np.column_stack([_column(timeline, f"q{i}")[first] for i in range(4)])
    fixes = _on(t_ns, digest.fixes)
    position = _vectors(fixes, "{}_m", fixes["valid"] == 1)
    velocity = _vectors(fixes, "v{}_mps", fixes["valid"] == 1)
    counts = {k: np.where(fixes["valid"] == 1, fixes[k], np.nan) for k in
              ("satellites_used", "measurements", "pdop", "pdop_distinct")}  # fmt: skip
    counts |= {k: _column(timeline, k)[first].astype(float) for k in ("bits", "faults")}
    truth_m = truth_mps = visible = error = sigma = None
    if len(rows):
        truth_m, truth_mps, visible = _truth_on(t_ns, rows)
        axes = radial_along_cross(truth_m, truth_mps)
        error = np.einsum("nij,nj->ni", axes, position - truth_m)
        said = covariance(_vectors(fixes, "sigma_{}_m"), np.column_stack([fixes[f"rho_{p}"] for p in
                                                                          ("xy", "xz", "yz")]))  # fmt: skip
        sigma = np.where(np.isnan(error), np.nan, sigmas_along(axes, said))
    here = position if truth_m is None else np.where(np.isnan(position), truth_m, position)
    usable = ~np.logical_or.reduce(np.isnan(np.column_stack([here, quaternion])), axis=1)
    looks = instants(usable)
    table = read_channels(channels, name, t_ns, looks) if channels is not None else None
    held, bridge = _bridged(table, vehicle.antennas, interval_ns) if table else (None, 0)
    return Craft(
        name=name, vehicle=vehicle, interval_ns=interval_ns, t_ns=t_ns,
        position_m=position, velocity_mps=velocity, truth_m=truth_m, truth_mps=truth_mps, visible=visible,
        error_m=error, sigma_m=sigma, counts=counts, quaternion=quaternion,
        holds=held, bridge_ns=bridge,
        strength=table.strength(vehicle.antennas) if table else None,
        sightings=_sightings(
            table, t_ns, here, quaternion, looks, vehicle, places(digest.almanac.rows)
        ) if table else None,
        handed=digest.commands.handed,
    )  # fmt: skip


def _sightings(
    table: Channels, t_ns, here_m, quaternion, rows, vehicle: Vehicle, almanac: Places
) -> Sightings:
    keep = table.seen_by <= vehicle.antennas
    measured = Places(*(getattr(table.seen, f)[keep] for f in Places.__slots__))
    return look(
        t_ns[rows],
        here_m[rows],
        quaternion[rows],
        vehicle.boresight_body,
        measured,
        table.seen_by[keep],
        almanac,
    )


def _column(table, name: str) -> NDArray:
    return table.get(name, np.zeros(0))


_FIX_COLUMNS = ("valid", "satellites_used", "measurements", "pdop", "pdop_distinct", "x_m", "y_m", "z_m",
                "vx_mps", "vy_mps", "vz_mps", "sigma_x_m", "sigma_y_m", "sigma_z_m",
                "rho_xy", "rho_xz", "rho_yz")  # fmt: skip


def _on(t_ns: NDArray[np.int64], fixes) -> dict[str, NDArray[np.float64]]:
    """Columns of fixes (e,) on time marks; nan where none was reported."""
    out = {name: np.full(len(t_ns), np.nan) for name in _FIX_COLUMNS}
    if fixes:
        at = np.searchsorted(t_ns, fixes["t_ns"])
        for name, column in out.items():
            column[at] = fixes[name]
    return out


def _vectors(columns, pattern: str, where=True) -> NDArray[np.float64]:
    vectors = np.column_stack([columns[pattern.format(a)] for a in "xyz"])
    return np.where(np.reshape(where, (-1, 1)), vectors, np.nan)


def _truth_on(t_ns: NDArray[np.int64], rows: np.ndarray):
    at = np.minimum(np.searchsorted(rows["t_gps_ns"], t_ns), len(rows) - 1)
    known = rows["t_gps_ns"][at] == t_ns
    one = known[:, None]
    return (
        np.where(one, rows["position_ecef_m"][at], np.nan),
        np.where(one, rows["velocity_ecef_mps"][at], np.nan),
        np.where(known, rows["satellites_visible"][at].astype(float), np.nan),
    )


def _bridged(table: Channels, receivers: int, interval_ns: int) -> tuple[Holds, int]:
    """Stretches, breaks bridged just long enough that they can be drawn; how long."""
    one_by_one = (holds(*table.tracked(receiver), interval_ns) for receiver in range(1, receivers + 1))
    found, bridge = joined(list(one_by_one)), 0
    while len(found) > _MOST_HOLDS:
        bridge = max(2 * bridge, interval_ns)
        found = bridged(found, bridge)
    return found, bridge
