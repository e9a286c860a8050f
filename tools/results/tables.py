"""The tables of a run folder: decoded from bus.log through the DBC, and truth from its stream."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.messages import VALUES
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.recording.formats.candump import read_chunks
from gnss_hil.tools.results.truth import Truth

_ROWS_PER_PART = 200_000
_TRUTH_ROWS = 10_000
_SATELLITE_NAMES = np.array([satellites.name(i) for i in range(satellites.SATELLITES)])


def _labels(table: str, raw) -> np.ndarray:
    """Names of raw values; the number itself where the table has no name for it."""
    names, raw = VALUES[table], np.asarray(raw, int)
    lookup = np.array([names.get(i, str(i)) for i in range(raw.max(initial=0) + 1)])
    return lookup[raw]


def _seconds(t_ns) -> np.ndarray:
    return np.asarray(t_ns, np.int64) / NS_PER_S


def _with_craft(craft: str, columns: Mapping) -> dict:
    n = len(next(iter(columns.values())))
    return {"craft": np.full(n, craft), **columns}


def fix_columns(craft: str, fixes: Mapping[str, np.ndarray]) -> dict:
    """fixes.parquet: the columns that are promised first, what else the bus says behind."""
    if not fixes:
        return {}
    axes = {f"{a}_ecef_m": fixes[f"{a}_m"] for a in "xyz"}
    rates = {f"v{a}_ecef_mps": fixes[f"v{a}_mps"] for a in "xyz"}
    whole = {name: fixes[name].astype(int) for name in ("satellites", "measurements", "satellites_used")}
    return _with_craft(
        craft,
        {"t_gps_s": _seconds(fixes["t_ns"]), "valid": fixes["valid"], **axes, **rates}
        | {"clock_bias_m": fixes["clock_bias_m"], "satellites": whole["satellites"], "pdop": fixes["pdop"]}
        | {"mode": _labels("NavMode", fixes["mode"]), "no_fix": _labels("NoFix", fixes["no_fix"])}
        | {"measurements": whole["measurements"], "satellites_used": whole["satellites_used"]}
        | {"pdop_distinct": fixes["pdop_distinct"]}
        | {f"sigma_{a}_ecef_m": fixes[f"sigma_{a}_m"] for a in "xyz"}
        | {f"rho_{pair}": fixes[f"rho_{pair}"] for pair in ("xy", "xz", "yz")},
    )


def epoch_columns(craft: str, timeline: Mapping[str, np.ndarray]) -> dict:
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


def channel_columns(craft: str, cells: Mapping[str, np.ndarray]) -> dict:
    """channels.parquet: one row per tracked channel and epoch."""
    copied = (
        "pseudorange_m", "range_rate_mps", "phase_cyc", "slips", "half_cycle", "cn0_dbhz", "used",
    )  # fmt: skip
    return _with_craft(
        craft,
        {"t_gps_s": _seconds(cells["t_ns"]), "receiver": cells["receiver"], "channel": cells["channel"]}
        | {"satellite": _SATELLITE_NAMES[cells["sat"]], "signal": _labels("Signal", cells["signal"])}
        | {"lock": _labels("Lock", cells["lock"])}
        | {name: cells[name] for name in copied}
        | {f"sv_{a}_ecef_m": cells[f"{a}_m"] for a in "xyz"}
        | {f"sv_v{a}_ecef_mps": cells[f"v{a}_mps"] for a in "xyz"}
        | {
            f"sv_{name}": cells[name]
            for name in ("clock_m", "clock_drift_mps", "iod", "ura", "health", "frequency")
        },
    )


def assignment_columns(craft: str, events: Mapping[str, list]) -> dict:
    """assignments.parquet: every channel command, its repeats and its acknowledgements."""
    rest = {name: np.asarray(values) for name, values in events.items() if name != "t_ns"}
    return _with_craft(craft, {"t_gps_s": _seconds(events["t_ns"]), **rest})


def truth_columns(craft: str, rows: np.ndarray) -> dict:
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
    """A table written piece by piece in bounded memory: parts beside it, put together at the end."""

    def __init__(self, path: Path):
        self._path = path
        self._parts = tempfile.TemporaryDirectory(prefix=f".{path.stem}-", dir=path.parent)
        self._names: list[Path] = []
        self._pieces: list[Mapping] = []
        self._rows = 0

    def add(self, columns: Mapping) -> None:
        if not columns or not len(columns["craft"]):
            return
        self._pieces.append(columns)
        self._rows += len(columns["craft"])
        if self._rows >= _ROWS_PER_PART:
            self._write_part()

    def _write_part(self) -> None:
        import polars

        columns = {k: np.concatenate([p[k] for p in self._pieces]) for k in self._pieces[0]}
        self._names.append(Path(self._parts.name) / f"{len(self._names):06d}.parquet")
        polars.DataFrame(columns, nan_to_null=True).write_parquet(self._names[-1])
        self._pieces, self._rows = [], 0

    def close(self) -> None:
        """Put the table in place; an empty one is left out."""
        import polars

        if self._pieces:
            self._write_part()
        if len(self._names) == 1:
            self._names[0].replace(self._path)
        elif self._names:
            polars.scan_parquet(self._names).sink_parquet(self._path)
        self._parts.cleanup()


def digest_log(path: Path, buses: Iterable[str], codecs: Iterable[Codec], channels: Mapping[str, object]):
    """Digests of the buses in a log, by bus name; `channels` maps a bus to what takes its channel table."""
    digests = {bus: Digest(codec, channels.get(bus)) for bus, codec in zip(buses, codecs, strict=True)}
    with Path(path).open("rb") as log:
        for _, names, frames in read_chunks(log, path.name):
            for bus, digest in digests.items():
                mine = names == bus.encode()
                digest.feed(frames if mine.all() else frames[mine])
    for digest in digests.values():
        digest.finish()
    return digests


def write_fixes_and_truth(folder: Path, digests: Mapping[str, Digest], truth: Truth | None) -> None:
    """fixes, assignments, epochs and truth tables of a run; digests by craft name."""
    for name, columns_of in (
        ("epochs", lambda craft, d: epoch_columns(craft, d.timeline)),
        ("fixes", lambda craft, d: fix_columns(craft, d.fixes)),
        ("assignments", lambda craft, d: assignment_columns(craft, d.commands.events)),
    ):
        table = ParquetTable(folder / f"{name}.parquet")
        for craft, digest in digests.items():
            table.add(columns_of(craft, digest))
        table.close()
    if truth is not None:
        table = ParquetTable(folder / "truth.parquet")
        for craft in truth.craft:
            rows = truth.of(craft)
            for begin in range(0, len(rows), _TRUTH_ROWS):
                table.add(truth_columns(craft, rows[begin : begin + _TRUTH_ROWS]))
        table.close()
