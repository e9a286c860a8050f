"""What the report of a failed test says of its runs: where they are, how to repeat them, what was seen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import polars as pl

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.bench.errors import BenchError
from gnss_hil.tools.bench.record import Run
from gnss_hil.tools.common.durations import clock
from gnss_hil.tools.results.text import broken_off

MOST = 12
"""Checks that are told of a run, the first to see something first."""


def text(folders: Sequence[Path]) -> str:
    """Of run folders, in their order."""
    return "\n\n".join("\n".join(_run(folder)) for folder in folders)


def _run(folder: Path) -> Iterator[str]:
    yield f"run folder  {folder}"
    try:
        run = Run.read(folder)
        yield f"again       {run.command}"
        yield f"report      {_report(run)}"
        yield f"ended       {broken_off(run.summary) or 'complete'}"
        yield from _headed("missed", run.missed)
        yield from _headed("faults", _faults(run))
        yield from _headed("checks", _checks(run))
    except BenchError as error:
        yield f"record      {error}"


def _report(run: Run) -> str:
    try:
        return str(run.report)
    except BenchError as error:
        return str(error)
    except OSError as error:
        return f"{error.filename}: {error.strerror}"


def _headed(word: str, lines: Iterable[str]) -> Iterator[str]:
    for number, line in enumerate(lines):
        yield f"{'' if number else word:<12}{line}"


def _faults(run: Run) -> Iterator[str]:
    """Stretches in which faults touched frames."""
    for row in run.faults.filter(pl.col("frames_touched") > 0).head(MOST).iter_rows(named=True):
        many = so_many(row["frames_touched"], "frame")
        behind = "" if row["active"] else ", behind its window"
        yield (
            f"{row['fault']} at {row['place']}: epochs {row['first_epoch']} to {row['last_epoch']}, "
            f"{many} touched{behind}"
        )


def _checks(run: Run) -> Iterator[str]:
    begin_s = run.epochs["t_gps_s"].min()
    seen = (
        run.checks.drop_nulls("t_gps_s")
        .group_by("craft", "check", "where")
        .agg(pl.col("t_gps_s").n_unique().alias("epochs"), pl.col("t_gps_s").min().alias("first_s") - begin_s)
        .sort("first_s", "craft", "check", "where")
    )
    several = len(run.summary["craft"]) > 1
    for row in seen.head(MOST).iter_rows(named=True):
        where = f"{row['craft']} {row['where']}" if several else row["where"]
        many = so_many(row["epochs"], "epoch")
        yield f"{row['check'].lower()} at {where}: {many}, first at {clock(row['first_s'])}"
    if len(seen) > MOST:
        yield f"and {len(seen) - MOST} more: checks.parquet"
