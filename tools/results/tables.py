"""The tables of a run folder: decoded from bus.log through the DBC, and truth from its stream."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results import checks, parquet
from gnss_hil.tools.results.parquet import Column, Columns, Labelled, Partial
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


def _code(table: str, name: str) -> Callable[[Rows], Labelled]:
    """The labels of raw values."""
    return lambda rows: _labelled(table, rows[name])


def _whole(name: str) -> Callable[[Rows], Column]:
    """Whole numbers, null for nan."""
    return lambda rows: _whole_numbers(np.asarray(rows[name]))


def _whole_numbers(values: NDArray) -> Column:
    present = ~np.isnan(values) if values.dtype.kind == "f" else np.ones(len(values), bool)
    return values.astype(int) if present.all() else Partial(np.where(present, values, 0).astype(int), present)


def _used(rows: Rows) -> Column:
    """Whether a channel is in the fix; null where the fix does not say."""
    return rows["used"] if rows["used_told"].all() else Partial(rows["used"], rows["used_told"])


def _words(name: str) -> Callable[[Rows], NDArray]:
    """A column of text, also where it has no rows."""
    return lambda rows: np.asarray(rows[name], str)


def _satellite(rows: Rows) -> Labelled:
    return Labelled(rows["sat"].astype(np.uint16), _satellite_names())


Rows = Mapping[str, Any]
Table = Mapping[str, str | Callable[[Rows], Column]]
"""Columns of a file behind craft and t_gps_s: a column of the digest by name, or what is made of its rows."""

FIXES: Table = {
    "valid": "valid",
    **{f"{a}_ecef_m": f"{a}_m" for a in "xyz"},
    **{f"v{a}_ecef_mps": f"v{a}_mps" for a in "xyz"},
    "clock_bias_m": "clock_bias_m",
    "satellites": _whole("satellites"),
    "pdop": "pdop",
    "mode": _code("NavMode", "mode"),
    "no_fix": _code("NoFix", "no_fix"),
    "measurements": _whole("measurements"),
    "satellites_used": _whole("satellites_used"),
    "satellites_paired": _whole("satellites_paired"),
    "pdop_distinct": "pdop_distinct",
    **{f"sigma_{a}_ecef_m": f"sigma_{a}_m" for a in "xyz"},
    **{f"rho_{pair}": f"rho_{pair}" for pair in ("xy", "xz", "yz")},
    **{f"sigma_v{a}_ecef_mps": f"sigma_v{a}_mps" for a in "xyz"},
    **{f"rho_v{pair}": f"rho_v{pair}" for pair in ("xy", "xz", "yz")},
    "sigma_clock_bias_m": "sigma_clock_bias_m",
    "clock_drift_mps": "clock_drift_mps",
    "sigma_clock_drift_mps": "sigma_clock_drift_mps",
    "clock_domain": "clock_domain",
    "tested": _code("Tested", "tested"),
    "excluded_satellites": _whole("excluded_satellites"),
    "excluded_receivers": _whole("excluded_receivers"),
    "excluded": _words("excluded"),
    "epoch": lambda rows: Partial(rows["epoch"], rows["epoch"] >= 0),
}
"""One row per navigation block: the columns that are promised first, the rest of its frames behind."""

EPOCHS: Table = {
    "epoch": "epoch",
    "bits": "bits",
    "frames_rejected": "faults",
    "satellites_measured": "satellites_measured",
    **{f"q{i}_body_from_ecef": f"q{i}" for i in range(4)},
}
"""One row per time mark: its epoch, bits, frames rejected, satellites measured, attitude as sent."""

_MEASURED = ("pseudorange_m", "range_rate_mps", "phase_cyc", "slips", "half_cycle", "cn0_dbhz")
_BROADCAST = ("clock_m", "clock_drift_mps", "iod", "ura", "health", "frequency")
CHANNELS: Table = {
    "receiver": "receiver",
    "channel": "channel",
    "satellite": _satellite,
    "signal": _code("Signal", "signal"),
    "lock": _code("Lock", "lock"),
    **{name: name for name in _MEASURED},
    "used": _used,
    **{f"sv_{a}_ecef_m": f"{a}_m" for a in "xyz"},
    **{f"sv_v{a}_ecef_mps": f"v{a}_mps" for a in "xyz"},
    **{f"sv_{name}": name for name in _BROADCAST},
}
"""One row per tracked channel and epoch."""

_EVENT = ("event", "receiver", "channel", "action", "satellite", "transaction", "result")
_EVENT_NUMBERS = ("receiver", "channel", "transaction")
ASSIGNMENTS: Table = {name: _whole(name) if name in _EVENT_NUMBERS else _words(name) for name in _EVENT}
"""Every channel command, its repeats and its acknowledgements."""


def columns_of(table: Table, craft: str, rows: Rows) -> Columns:
    """A craft's rows as they go into a file; nothing for a digest without any."""
    if not rows:
        return {}
    t_gps_s = np.asarray(rows["t_ns"], np.int64) / NS_PER_S
    return {
        "craft": Labelled(np.zeros(len(t_gps_s), np.uint8), (craft,)),
        "t_gps_s": t_gps_s,
        **{name: rows[how] if isinstance(how, str) else how(rows) for name, how in table.items()},
    }


def _truth_rows(rows: np.ndarray) -> dict[str, NDArray]:
    """Truth under the names of FIXES, and what else truth knows."""
    vectors = {
        "{}_ecef_m": ("position_ecef_m", "xyz"),
        "v{}_ecef_mps": ("velocity_ecef_mps", "xyz"),
        "q{}_body_from_ecef": ("quaternion_body_from_ecef", range(4)),
        "w{}_body_rps": ("rate_body_rps", "xyz"),
        "clock_{}_s": ("clock_s", range(rows["clock_s"].shape[1])),
    }
    return {
        form.format(axis): rows[field][:, i]
        for form, (field, axes) in vectors.items()
        for i, axis in enumerate(axes)
    } | {"satellites_visible": rows["satellites_visible"].astype(int)}


class ParquetTable:
    """A table written piece by piece in bounded memory: parts beside it, put together at the end.

    A table without a row has its columns, if a piece without rows has told them.

    A table has sections that grow side by side (one a craft); the sections follow each other in the end, so
    its rows do not depend on the pieces in which they came.
    """

    def __init__(self, path: Path):
        self._path = path
        self._folder: Path | None = None
        self._parts: list[tuple[int, int, Path]] = []
        self._pieces: dict[int, list[Columns]] = {}
        self._rows: Counter[int] = Counter()
        self._empty: Columns = {}

    def add(self, columns: Columns, section: int = 0) -> None:
        rows = len(next(iter(columns.values()))) if columns else 0
        if not rows:
            self._empty = self._empty or columns
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
        """Put the table in place."""
        for section in sorted(self._pieces):
            self._write_part(section)
        paths = [path for _, _, path in sorted(self._parts)]
        if len(paths) == 1:
            paths[0].replace(self._path)
        elif paths:
            parquet.join(self._path, paths)
        elif self._empty:
            parquet.write(self._path, [self._empty])
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


def write_fixes_and_truth(
    folder: Path,
    digests: Mapping[str, Digest],
    truth: Truth | None,
    bench_refused: Mapping[str, Sequence[Sequence[int]]] = MappingProxyType({}),
) -> None:
    """fixes, assignments, epochs, checks and truth tables of a run; digests by craft name.

    bench_refused   by craft: epochs in which the recorder did not believe bench frames, and how many
    """
    for name, table, rows_of in (
        ("epochs", EPOCHS, lambda digest: digest.timeline),
        ("fixes", FIXES, lambda digest: digest.fixes),
        ("assignments", ASSIGNMENTS, lambda digest: digest.commands.events),
    ):
        file = ParquetTable(folder / f"{name}.parquet")
        for section, (craft, digest) in enumerate(digests.items()):
            file.add(columns_of(table, craft, rows_of(digest)), section)
        file.close()
    file = ParquetTable(folder / "checks.parquet")
    for section, (craft, digest) in enumerate(digests.items()):
        file.add(checks.columns(craft, digest, bench_refused.get(craft, ())), section)
    file.close()
    if truth is not None:
        file = ParquetTable(folder / "truth.parquet")
        for section, craft in enumerate(truth.craft):
            rows = truth.of(craft)
            for begin in range(0, len(rows), _TRUTH_ROWS):
                piece = rows[begin : begin + _TRUTH_ROWS]
                columns = _truth_rows(piece)
                table = {name: name for name in columns}
                file.add(columns_of(table, craft, {"t_ns": piece["t_gps_ns"], **columns}), section)
        file.close()
