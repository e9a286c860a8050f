"""Which check saw something, and after how many epochs of a fault."""

from __future__ import annotations

import polars as pl

from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.tools.bench.errors import BenchError
from gnss_hil.tools.results.checks import CHECKS


def named(check: str) -> str:
    """A check by the name that tables have; BenchError if there is none."""
    name = check.strip().upper().replace("-", "_").replace(" ", "_")
    if name not in CHECKS and not name.startswith("UNKNOWN_"):
        known = [label.lower() for label in CHECKS]
        raise BenchError(f"check '{check}': not known; {did_you_mean(check, known, 'there are')}")
    return name


def seen(checks: pl.DataFrame, check: str, where: str | None = None) -> pl.DataFrame:
    """The rows of a check, of a message or node, or of any: "RX2" is the node and its messages "RX2_...".
    BenchError if there is no such check."""
    found = checks.filter(check=named(check))
    if where is None:
        return found
    name = where.strip().upper()
    return found.filter((pl.col("where") == name) | pl.col("where").str.starts_with(f"{name}_"))


def epochs_after(rows: pl.DataFrame, first_s: float, interval_s: float) -> list[int]:
    """Epochs from one at first_s [GPS s] to those of the rows, not before it, in order; 0 is that epoch."""
    late = ((rows["t_gps_s"].drop_nulls() - first_s) / interval_s).round().cast(pl.Int64)
    return sorted(set(late.filter(late >= 0).to_list()))
