"""`gnss-hil report`: tables, summary and report.html of a run again; or two runs compared."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gnss_hil.tools.common.errors import PROGRAM, Mistake


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("run", type=Path, metavar="RUN", help="run folder, made again from bus.log and truth")
    parser.add_argument("other", type=Path, nargs="?", metavar="RUN2", help="another: compare the two")
    parser.add_argument(
        "--out", type=Path, metavar="FILE",
        help="the HTML page (default RUN/report.html; of a comparison RUN/compare-RUN2.html)",
    )  # fmt: skip


def run(arguments: Namespace) -> int:
    for folder in (arguments.run, arguments.other):
        if folder is not None and not folder.is_dir():
            raise Mistake(f"{folder}: no such run folder")
    if arguments.out and not arguments.out.absolute().parent.is_dir():
        raise Mistake(f"--out {arguments.out}: no such folder {arguments.out.parent}")
    if arguments.out and arguments.out.is_dir():
        raise Mistake(f"--out {arguments.out}: is a folder; name a file")
    if arguments.other is None:
        return _again(arguments.run, arguments.out)
    return _compared(arguments.run, arguments.other, arguments.out)


def _compared(first: Path, second: Path, out: Path | None) -> int:
    """Figures side by side on stdout, plots in a page."""
    from gnss_hil.tools.report import compare
    from gnss_hil.tools.results.text import aligned, broken_off

    runs = compare.read(first), compare.read(second)
    path = out or first / f"compare-{runs[1].name}.html"
    names = [run.name for run in runs]
    print(f"{compare.title(*runs)}\n")
    print(aligned([("", *names, "ratio", ""), *compare.rows(runs[0].summary, runs[1].summary)]))
    print(f"\nreport: {compare.write(*runs, path)}")
    for key, mine, other in compare.differences(*runs):
        if key in ("scenario", "seed", "duration_s", "epoch_interval_s"):
            print(f"{PROGRAM}: the runs differ in {key}: {mine} and {other}", file=sys.stderr)
    for run in runs:
        if broken := broken_off(run.summary):
            print(f"{PROGRAM}: {run.name} is not complete: {broken}", file=sys.stderr)
    return 0


def _again(folder: Path, out: Path | None) -> int:
    """Everything that a run's log tells, anew."""
    from gnss_hil.tools.recording.run_folder import LOG, SCENARIO
    from gnss_hil.tools.results import assemble, run_digest
    from gnss_hil.tools.results.text import missed, render

    for name in (SCENARIO, LOG):
        if not (folder / name).is_file():
            reason = "; a run without a log cannot be reported again" if name == LOG else ""
            raise Mistake(f"{folder}: has no {name}{reason}")
    scenario, codecs = assemble.read_scenario(folder)
    craft = [c.name for c in scenario.craft]
    digests = run_digest.from_log(folder / LOG, craft, codecs)
    epochs = max(digest.epochs for digest in digests.values())
    facts = assemble.after_a_crash(assemble.read_facts(folder), scenario, epochs)
    summary = assemble.write(folder, facts, digests)
    print(render(summary))
    print()
    lines = draw(folder, facts, summary, digests, out) + missed(summary)
    for line in lines:
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return 1 if lines else 0


def draw(
    folder: Path,
    facts: Mapping[str, Any],
    summary: Mapping[str, Any],
    digests: Mapping[str, Any],
    out: Path | None = None,
    told: bool = True,
) -> list[str]:
    """report.html, its path on stdout if `told`; a line if it cannot be written: the figures are."""
    from gnss_hil.tools.recording.run_folder import SUMMARY
    from gnss_hil.tools.report import run_report

    path = out or folder / run_report.REPORT
    try:
        run_report.write(folder, facts, summary, digests, path)
    except OSError as error:
        return [f"{error.filename or path}: {error.strerror}; the figures are in {SUMMARY}"]
    if told:
        print(f"report:     {path}")
    return []
