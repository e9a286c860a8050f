"""The record of a finished run, read from its folder when it is asked for."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.tools.bench import detection
from gnss_hil.tools.bench.errors import BenchError, as_bench_errors
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.run_folder import LOG, SUMMARY
from gnss_hil.tools.results import assemble, run_digest
from gnss_hil.tools.results.checks import BENCH, REJECTIONS
from gnss_hil.tools.results.outages import CONVERGENCE_S
from gnss_hil.tools.results.text import missed
from gnss_hil.tools.results.trajectory import COLUMNS, of_table

_EXPECTATION = {
    "name": pl.String, "min": pl.Float64, "max": pl.Float64, "after_s": pl.Float64, "found": pl.Float64,
    "met": pl.Boolean,
}  # fmt: skip


_FAULTS = {
    **dict.fromkeys(("craft", "fault", "kind", "place", "direction"), pl.String), "active": pl.Boolean,
    **dict.fromkeys(
        ("first_epoch", "last_epoch", "epochs", "frames_touched", "frames_missing", "values_clipped"),
        pl.Int64,
    ),
    "first_struck": pl.Int64,
    "detected_by": pl.String, "after_epochs": pl.Int64,
    "expected_by": pl.String, "expected_after_epochs": pl.Int64,
    "fix_error_m": pl.Float64, "fixes_unjudged": pl.Int64, "availability": pl.Float64, "met": pl.Boolean,
}  # fmt: skip

_STEP_S = 1e-6
"""Less than any interval, and more than the steps of `t_gps_s`, 0.24 us."""


@dataclass(frozen=True, repr=False)
class Run:
    """A finished run. Its tables are Polars data frames, read once, when they are asked for; docs/figures.md
    has every column. `t_gps_s` are seconds of continuous GPS time since 1980-01-06.

    folder     with bus.log, tables, summary.json
    craft      whose tables these are; None: of all craft, told apart by their column `craft`
    failures   how the run broke off, and why its record is not the flight; none of a sound run
    notes      what is odd about it, and changed nothing
    """

    folder: Path
    craft: str | None = None
    failures: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        of = f", craft={self.craft!r}" if self.craft else ""
        return f"Run({str(self.folder)!r}{of})"

    @classmethod
    def read(cls, folder: str | Path) -> Run:
        """The record of a run folder, of `gnss-hil run` too. BenchError if it is none."""
        found = cls(Path(folder))
        failure = found.summary.get("failure")
        return replace(
            found, failures=(failure,) if failure else (), notes=tuple(found.summary.get("remarks", ()))
        )

    def of(self, craft: str) -> Run:
        """The same record with the tables, errors and checks of one craft alone."""
        if craft not in self.summary["craft"]:
            raise BenchError(
                f"craft '{craft}': not in this run; {did_you_mean(craft, self.summary['craft'])}"
            )
        return replace(self, craft=craft)

    @cached_property
    def summary(self) -> Mapping[str, Any]:
        """summary.json: figures of the run, and of each craft under `craft`."""
        path = self.folder / SUMMARY
        if not path.is_file():
            raise BenchError(
                f"{self.folder}: has no {SUMMARY}; `gnss-hil report {self.folder}` makes it of a log"
            )
        try:
            return json.loads(path.read_bytes())
        except ValueError:
            raise BenchError(f"{path}: is damaged; `gnss-hil report {self.folder}` makes it again") from None

    @property
    def status(self) -> str:
        """How it ended: "complete", "interrupted" or "failed"."""
        return self.summary["ended"]

    @cached_property
    def command(self) -> str:
        """The command line that plays it again; "" where the record does not say."""
        with as_bench_errors():
            facts = assemble.read_facts(self.folder) or {}
        return facts.get("about", {}).get("command", "")

    # --- tables -----------------------------------------------------------------------------------------

    @cached_property
    def fixes(self) -> pl.DataFrame:
        """One row for each epoch of which the flight software said anything."""
        return self._table("fixes")

    @cached_property
    def truth(self) -> pl.DataFrame:
        """One row for each epoch, where our emulator ran: position, velocity, attitude, clocks."""
        return self._table("truth")

    @cached_property
    def epochs(self) -> pl.DataFrame:
        """One row for each time mark: bits on the bus, frames refused, satellites measured, attitude."""
        return self._table("epochs")

    @cached_property
    def channels(self) -> pl.DataFrame:
        """One row for each channel that measured, and epoch; not of a run without a log."""
        return self._table("channels")

    @cached_property
    def assignments(self) -> pl.DataFrame:
        """One row for each channel command, its repeats and its acknowledgement."""
        return self._table("assignments")

    @cached_property
    def checks(self) -> pl.DataFrame:
        """What each check saw, by epoch: craft, t_gps_s, check, where, count, and by
        whom: BENCH, in the record, or FLIGHT, by the flight software's own word."""
        return self._table("checks")

    @cached_property
    def faults(self) -> pl.DataFrame:
        """What faults did: one row for each stretch of epochs in which one acted, with its name and place,
        first_epoch, last_epoch, frames_touched, and what became of it: detected_by, after_epochs,
        expected_by, expected_after_epochs, fix_error_m, fixes_unjudged, availability, met; no rows of a run
        without faults."""
        if not (self.folder / "faults.parquet").is_file():
            return pl.DataFrame(schema=_FAULTS)
        return self._table("faults")

    def _table(self, name: str) -> pl.DataFrame:
        path = self.folder / f"{name}.parquet"
        if not path.is_file():
            raise BenchError(f"{self.folder}: has no {path.name}")
        try:
            found = pl.read_parquet(path)
        except pl.exceptions.ComputeError as error:
            raise BenchError(f"{path}: {str(error).splitlines()[0]}") from None
        return found if self.craft is None else found.filter(craft=self.craft)

    @cached_property
    def rejected(self) -> pl.DataFrame:
        """Frames refused in the run: craft, reason, where (message or identifier), count; most first."""
        refused = self.checks.filter(pl.col("check").is_in(REJECTIONS), by=BENCH)
        of_each = refused.group_by("craft", pl.col("check").alias("reason"), "where")
        counted = of_each.agg(pl.col("count").sum())
        return counted.sort("count", "craft", "reason", "where", descending=[True, False, False, False])

    # --- how good the fixes are -------------------------------------------------------------------------

    @cached_property
    def errors(self) -> pl.DataFrame:
        """Fix minus truth, at the time that the fix's mark shows, of every valid fix: craft, t_gps_s, t_s
        (since the run's first epoch), position_error_m and velocity_error_mps (3-D, ECEF, at the centre of
        mass; nan where truth does not reach), converged."""
        begin_s = self.epochs["t_gps_s"].min()
        first_s = pl.col("t_gps_s").first().over("craft")
        settled = pl.col("t_gps_s") > first_s + CONVERGENCE_S - _STEP_S
        return _against(self.fixes.filter("valid"), self.truth).select(
            "craft",
            "t_gps_s",
            t_s=pl.col("t_gps_s") - begin_s,
            position_error_m=_distance("{}_ecef_m"),
            velocity_error_mps=_distance("v{}_ecef_mps"),
            converged=settled.cast(int).cum_max().over("craft").cast(bool),  # marks may go back
        )

    @property
    def fix_error_m(self) -> F64:
        """(n,) 3-D position errors [m] of the valid fixes from 60 s after the first one on, by time: a cold
        start's first fixes have six satellites, and tell of nothing else. `errors` has them all.

        BenchError if the run was over by then.
        """
        if not self._converged("epochs"):
            raise BenchError(self._too_short())
        return self.errors.filter("converged")["position_error_m"].to_numpy()

    @property
    def availability(self) -> float:
        """Share of epochs with a valid fix, 0 to 1, from 60 s after the first fix on; 0 if there was none.

        BenchError if the run was over by then.
        """
        if all(figures["first_fix_s"] is None for figures in self._figures):
            return 0.0
        if not self._converged("epochs"):
            raise BenchError(self._too_short())
        return self._converged("fixes") / self._converged("epochs")

    @property
    def _antennas(self) -> list[tuple[str, ...]]:
        """Names of the antennas, of each craft."""
        with as_bench_errors():
            of = assemble.antennas(self.folder)
        return [names for craft, names in of.items() if self.craft in (None, craft)]

    @property
    def _figures(self) -> list[Mapping[str, Any]]:
        crafts = self.summary["craft"]
        return list(crafts.values()) if self.craft is None else [crafts[self.craft]]

    def _converged(self, what: str) -> int:
        return sum(figures["converged"][what] for figures in self._figures)

    def _too_short(self) -> str:
        first_s = [f["first_fix_s"] for f in self._figures if f["first_fix_s"] is not None]
        said = f"the first fix came after {min(first_s):g} s" if first_s else "there was no fix"
        return (
            f"{self.folder.name}: over before convergence, {CONVERGENCE_S:g} s after the first fix: {said} "
            f"of {self.summary['duration_s']:g} s; play longer, or look at `errors`, which has all fixes"
        )

    # --- verdicts ---------------------------------------------------------------------------------------

    def detected(
        self, check: str, *, within: int | None = None, fault: str | None = None, where: str | None = None
    ) -> bool:
        """Whether a check saw something: in the whole run, or of a fault.

        check    "silence" or "restart" of a node; a reason for which frames are refused ("corrupted",
                 "repeated", "wrong_sequence", "mixed_epoch", ...); "lost", frames missing in a stream;
                 "mark", a time mark missing or jumping; "no_answer", a command sent again; or a reason why
                 there is no fix ("too_few_satellites", "inconsistent_ranges", "not_reported", ...)
        within   so many epochs behind the fault's first one, in which it acted, and which is 0
        fault    its name in `faults`; None: the only one, if `within` is given
        where    node, message, antenna or satellite that the check must be of, "RX2", "RX2_RANGE", "aft" or
                 "G07"; None: of any

        BenchError if there is no such check, place or fault, or if the fault never acted.
        """
        rows = detection.seen(self.checks, check, where, self._antennas if where is not None else ())
        if within is None and fault is None:
            return not rows.is_empty()
        late = detection.late(rows, detection.first_epochs(self.faults, fault))
        return bool(late) and (within is None or late[0] <= within)

    @cached_property
    def expectations(self) -> pl.DataFrame:
        """Verdicts of the scenario's [expect]: name, min, max, after_s, found, met."""
        return pl.DataFrame(list(self.summary["expectations"]), schema=_EXPECTATION, strict=False)

    @property
    def missed(self) -> list[str]:
        """A line for each expectation that was not met."""
        return missed(self.summary)

    @property
    def report(self) -> Path:
        """report.html, drawn now if it is not there. BenchError if the run has no log to draw it from."""
        from gnss_hil.tools.report import run_report

        path = self.folder / run_report.REPORT
        if path.is_file():
            return path
        with as_bench_errors(self.folder):
            if not (self.folder / LOG).is_file():
                raise Mistake(f"{self.folder}: has no {LOG}; a run without a log cannot be reported again")
            scenario, codecs = assemble.read_scenario(self.folder)
            digests = run_digest.from_log(self.folder / LOG, [c.name for c in scenario.craft], codecs)
            epochs = max(digest.epochs for digest in digests.values())
            facts = assemble.after_a_crash(assemble.read_facts(self.folder), scenario, epochs)
            run_report.write(self.folder, facts, self.summary, digests, path)
        return path


def _against(fixes: pl.DataFrame, truth: pl.DataFrame) -> pl.DataFrame:
    """Fixes, by craft in their order, with the truth at their times in columns X_true; nan where it is not
    known."""
    found = [fixes.clear().with_columns(pl.lit(None, pl.Float64).alias(f"{name}_true") for name in _MOVING)]
    for craft in truth["craft"].unique(maintain_order=True):
        mine, true = (table.filter(craft=craft) for table in (fixes, truth))
        rows = {name: true[name].to_numpy() for name in COLUMNS}
        there = np.column_stack(of_table(rows, mine["t_gps_s"].to_numpy()))
        found.append(
            mine.with_columns(pl.Series(f"{n}_true", c) for n, c in zip(_MOVING, there.T, strict=True))
        )
    return pl.concat(found)


_MOVING = COLUMNS[1:]


def _distance(pattern: str) -> pl.Expr:
    """Length of the difference of a vector's columns to those of the truth."""
    names = [pattern.format(axis) for axis in "xyz"]
    return sum(((pl.col(name) - pl.col(f"{name}_true")) ** 2 for name in names), pl.lit(0.0)).sqrt()
