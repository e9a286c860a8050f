"""Which check saw something, and after how many epochs of a fault."""

from __future__ import annotations

from collections.abc import Mapping

import polars as pl

from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.tools.bench.errors import BenchError
from gnss_hil.tools.results.checks import CHECKS
from gnss_hil.tools.results.detectors import ROWS


def named(check: str) -> tuple[str, ...]:
    """A check by the names that tables have, or those that a word of `detected_by` means; BenchError if there
    is none."""
    name = check.strip().upper().replace("-", "_").replace(" ", "_")
    meant = ROWS.get(name.lower().replace("_", "-"), ())
    if name in CHECKS or name.startswith("UNKNOWN_"):
        return (name, *meant)
    if meant:
        return meant
    known = [label.lower() for label in CHECKS]
    raise BenchError(f"check '{check}': not known; {did_you_mean(check, known, 'there are')}")


def seen(checks: pl.DataFrame, check: str, where: str | None = None) -> pl.DataFrame:
    """The rows of a check, of a message or node, or of any: "RX2" is the node and its messages "RX2_...".
    BenchError if there is no such check."""
    found = checks.filter(pl.col("check").is_in(named(check)))
    if where is None:
        return found
    name = where.strip().upper()
    return found.filter((pl.col("where") == name) | pl.col("where").str.starts_with(f"{name}_"))


def first_epochs(faults: pl.DataFrame, fault: str | None) -> Mapping[str, int]:
    """First epoch in which a fault touched a frame, or of its window where it acts elsewhere, by craft; None:
    the only one. BenchError if there is no such one,
    or if it never acted."""
    known = faults["fault"].unique(maintain_order=True).to_list()
    if fault is None and len(known) > 1:
        raise BenchError(f"fault=: which of {len(known)}? {', '.join(map(repr, known))}")
    if fault is not None and fault not in known:
        raise BenchError(f"fault '{fault}': never acted in this run; {_acted(fault, known)}")
    if not known:
        raise BenchError("within=: counts from a fault, and none acted in this run")
    mine = faults.filter(pl.col("active"), fault=fault or known[0])
    struck = mine.filter(pl.col("first_struck").is_not_null())
    begun = (struck, "first_struck") if len(struck) else (mine, "first_epoch")
    return dict(begun[0].group_by("craft").agg(pl.col(begun[1]).min()).iter_rows())


def _acted(fault: str, known: list[str]) -> str:
    return did_you_mean(fault, known, "those that did are") if known else "none did"


def late(rows: pl.DataFrame, first: Mapping[str, int]) -> list[int]:
    """Epochs from a fault's first one on its craft, which is 0, to those of rows that are not before it."""
    crafts = pl.DataFrame({"craft": list(first), "first": list(first.values())}, schema={**_FIRST})
    behind = rows.join(crafts, on="craft").select(pl.col("epoch") - pl.col("first")).to_series()
    return sorted(set(behind.filter(behind >= 0).to_list()))


_FIRST = {"craft": pl.String, "first": pl.Int64}
