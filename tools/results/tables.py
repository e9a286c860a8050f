"""The tables of a run folder: decoded from bus.log through the DBC, and truth from its stream."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.messages import VALUES
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.parquet import Columns, Labelled
from gnss_hil.tools.results.truth import Truth

_ROWS_PER_PART = 50_000
_TRUTH_ROWS = 10_000


@cache
def _labels_of(table: str) -> tuple[str, ...]:
    """Names of raw values; the number itself where the table has no name for it."""
    return tuple(VALUES[table].get(raw, str(raw)) for raw in range(256))


@cache
def _satellite_names() -> tuple[str, ...]:
    return tuple(satellites.name(i) for i in range(satellites.SATELLITES))


def _labelled(table: str, raw: NDArray) -> Labelled:
    return Labelled(raw.astype(np.uint8), _labels_of(table))


def _seconds(t_ns) -> F64:
    return np.asarray(t_ns, np.int64) / NS_PER_S


def _with_craft(craft: str, columns: Columns) -> Columns:
    n = len(next(iter(columns.values())))
    return {"craft": Labelled(np.zeros(n, np.uint8), (craft,)), **columns}


def fix_columns(craft: str, fixes: Mapping[str, np.ndarray]) -> Columns:
    """fixes.parquet: the columns that are promised first, the rest of the navigation frames behind."""
    if not fixes:
        return {}
    axes = {f"{a}_ecef_m": fixes[f"{a}_m"] for a in "xyz"}
    rates = {f"v{a}_ecef_mps": fixes[f"v{a}_mps"] for a in "xyz"}
    whole = {name: fixes[name].astype(int) for name in ("satellites", "measurements", "satellites_used")}
    return _with_craft(
        craft,
        {"t_gps_s": _seconds(fixes["t_ns"]), "valid": fixes["valid"], **axes, **rates}
        | {"clock_bias_m": fixes["clock_bias_m"], "satellites": whole["satellites"], "pdop": fixes["pdop"]}
        | {"mode": _labelled("NavMode", fixes["mode"]), "no_fix": _labelled("NoFix", fixes["no_fix"])}
        | {"measurements": whole["measurements"], "satellites_used": whole["satellites_used"]}
        | {"pdop_distinct": fixes["pdop_distinct"]}
        | {f"sigma_{a}_ecef_m": fixes[f"sigma_{a}_m"] for a in "xyz"}
        | {f"rho_{pair}": fixes[f"rho_{pair}"] for pair in ("xy", "xz", "yz")},
    )


def epoch_columns(craft: str, timeline: Mapping[str, np.ndarray]) -> Columns:
    """epochs.parquet: one row per time mark: bits on the bus, frames rejected, attitude as sent."""
    if not timeline:
        return {}
    return _with_craft(
        craft,
        {
            "t_gps_s": _seconds(timeline["t_ns"]),
            "bits": timeline["bits"],
            "frames_rejected": timeline["faults"],
        }
        | {f"q{i}_body_from_ecef": timeline[f"q{i}"] for i in range(4)},
    )


def channel_columns(craft: str, cells: Mapping[str, np.ndarray]) -> Columns:
    """channels.parquet: one row per tracked channel and epoch."""
    copied = (
        "pseudorange_m", "range_rate_mps", "phase_cyc", "slips", "half_cycle", "cn0_dbhz", "used",
    )  # fmt: skip
    return _with_craft(
        craft,
        {"t_gps_s": _seconds(cells["t_ns"]), "receiver": cells["receiver"], "channel": cells["channel"]}
        | {
            "satellite": Labelled(cells["sat"].astype(np.uint16), _satellite_names()),
            "signal": _labelled("Signal", cells["signal"]),
        }
        | {"lock": _labelled("Lock", cells["lock"])}
        | {name: cells[name] for name in copied}
        | {f"sv_{a}_ecef_m": cells[f"{a}_m"] for a in "xyz"}
        | {f"sv_v{a}_ecef_mps": cells[f"v{a}_mps"] for a in "xyz"}
        | {
            f"sv_{name}": cells[name]
            for name in ("clock_m", "clock_drift_mps", "iod", "ura", "health", "frequency")
        },
    )


def assignment_columns(craft: str, events: Mapping[str, list]) -> Columns:
    """assignments.parquet: every channel command, its repeats and its acknowledgements."""
    rest = {name: np.asarray(values) for name, values in events.items() if name != "t_ns"}
    return _with_craft(craft, {"t_gps_s": _seconds(events["t_ns"]), **rest})


def truth_columns(craft: str, rows: np.ndarray) -> Columns:
    """truth.parquet: position and velocity under the same names as the fixes, and what else truth knows."""
    position, velocity = rows["position_ecef_m"], rows["velocity_ecef_mps"]
    return _with_craft(
        craft,
        {"t_gps_s": _seconds(rows["t_gps_ns"])}
        | {f"{a}_ecef_m": position[:, i] for i, a in enumerate("xyz")}
        | {f"v{a}_ecef_mps": velocity[:, i] for i, a in enumerate("xyz")}
        | {f"q{i}_body_from_ecef": rows["quaternion_body_from_ecef"][:, i] for i in range(4)}
        | {f"w{a}_body_rps": rows["rate_body_rps"][:, i] for i, a in enumerate("xyz")}
        | {f"clock_{i}_s": rows["clock_s"][:, i] for i in range(rows["clock_s"].shape[1])}
        | {"satellites_visible": rows["satellites_visible"].astype(int)},
    )


class ParquetTable:
    """A table written piece by piece in bounded memory: parts beside it, put together at the end.

    A table has sections that grow side by side (one a craft); the sections follow each other in the end, so
    its rows do not depend on the pieces in which they came.
    """

    def __init__(self, path: Path):
        self._path = path
        self._folder: Path | None = None
        self._parts: list[tuple[int, int, Path]] = []
        self._pieces: dict[int, list[Columns]] = {}
        self._rows: Counter[int] = Counter()

    def add(self, columns: Columns, section: int = 0) -> None:
        rows = len(next(iter(columns.values()))) if columns else 0
        if not rows:
            return
        self._pieces.setdefault(section, []).append(columns)
        self._rows[section] += rows
        if self._rows[section] >= _ROWS_PER_PART:
            self._write_part(section)

    def _write_part(self, section: int) -> None:
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix=f".{self._path.stem}-parts-", dir=self._path.parent))
        number = len(self._parts)
        path = self._folder / f"{number:06d}.parquet"
        parquet.write(path, self._pieces.pop(section))
        self._parts.append((section, number, path))
        self._rows[section] = 0

    def close(self) -> None:
        """Put the table in place; an empty one is left out."""
        for section in sorted(self._pieces):
            self._write_part(section)
        paths = [path for _, _, path in sorted(self._parts)]
        if len(paths) == 1:
            paths[0].replace(self._path)
        elif paths:
            parquet.join(self._path, paths)
        self.discard()

    def discard(self) -> None:
        """Remove the parts."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        self._folder, self._parts, self._pieces = None, [], {}
        self._rows.clear()


def remove_parts(folder: Path) -> None:
    """Parts of tables that a run which died left in its folder."""
    for parts in folder.glob(".*-parts-*"):
        shutil.rmtree(parts, ignore_errors=True)


def write_fixes_and_truth(folder: Path, digests: Mapping[str, Digest], truth: Truth | None) -> None:
    """fixes, assignments, epochs and truth tables of a run; digests by craft name."""
    for name, columns_of in (
        ("epochs", lambda craft, d: epoch_columns(craft, d.timeline)),
        ("fixes", lambda craft, d: fix_columns(craft, d.fixes)),
        ("assignments", lambda craft, d: assignment_columns(craft, d.commands.events)),
    ):
        table = ParquetTable(folder / f"{name}.parquet")
        for section, (craft, digest) in enumerate(digests.items()):
            table.add(columns_of(craft, digest), section)
        table.close()
    if truth is not None:
        table = ParquetTable(folder / "truth.parquet")
        for section, craft in enumerate(truth.craft):
            rows = truth.of(craft)
            for begin in range(0, len(rows), _TRUTH_ROWS):
                table.add(truth_columns(craft, rows[begin : begin + _TRUTH_ROWS]), section)
        table.close()
