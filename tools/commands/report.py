"""`gnss-hil report`: tables, summary and report.html of a run again; or two runs compared."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gnss_hil.tools.common.errors import PROGRAM, Mistake
from gnss_hil.tools.common.places import check_new_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("run", type=Path, metavar="RUN", help="run folder, made again from bus.log and truth")
    parser.add_argument("other", type=Path, nargs="?", metavar="RUN2", help="another: compare the two")
    parser.add_argument(
        "--out", type=Path, metavar="FILE",
        help="the HTML page (default RUN/report.html; of a comparison RUN/compare-RUN2.html)",
    )  # fmt: skip
    parser.add_argument("--force", action="store_true", help="overwrite FILE")


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.recording.run_folder import check_run_folder

    for folder in filter(None, (arguments.run, arguments.other)):
        check_run_folder(folder, needs=())
    if arguments.out:
        check_new_file(arguments.out, arguments.force, f"--out {arguments.out}")
    if arguments.other is None:
        return again(arguments.run, arguments.out)
    return _compared(arguments.run, arguments.other, arguments.out)


def _compared(first: Path, second: Path, out: Path | None) -> int:
    """Figures side by side on stdout, plots in a page."""
    from gnss_hil.tools.report.comparison import figures, page, runs
    from gnss_hil.tools.results.text import broken_off

    pair = runs.read(first), runs.read(second)
    path = out or first / f"compare-{pair[1].name}.html"
    print("\n".join(figures.told(*pair)))
    print(f"\nreport: {page.write(*pair, path)}")
    if first.samefile(second):
        print(f"{PROGRAM}: note: {second} is the same run as {first}", file=sys.stderr)
    for run in pair:
        if broken := broken_off(run.summary):
            print(f"{PROGRAM}: {run.name} is not complete: {broken}", file=sys.stderr)
    return 0


def again(folder: Path, out: Path | None) -> int:
    """Everything that a run's log tells, anew."""
    from gnss_hil.tools.recording import fingerprints
    from gnss_hil.tools.recording.run_folder import LOG, check_run_folder
    from gnss_hil.tools.results import assemble, run_digest
    from gnss_hil.tools.results.text import broken_off, missed, render

    check_run_folder(folder)
    if not (folder / LOG).is_file():
        raise Mistake(f"{folder}: has no {LOG}; a run without a log cannot be reported again")
    scenario, codecs = assemble.read_scenario(folder)
    craft = [c.name for c in scenario.craft]
    digests = run_digest.from_log(folder / LOG, craft, codecs)
    epochs = max(digest.epochs for digest in digests.values())
    facts = assemble.after_a_crash(assemble.read_facts(folder), scenario, epochs)
    changed = [*fingerprints.changed(folder, facts.get("record", {}))]
    summary = assemble.write(folder, facts, digests, changed)
    print(f"{render(summary)}\n")
    for note in [*filter(None, [broken_off(summary)]), *assemble.new_remarks(facts, summary)]:
        print(f"{PROGRAM}: note: {note}", file=sys.stderr)
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
        old = f", the page {path} is of an earlier report" if path.exists() else ""
        return [f"{error.filename or path}: {error.strerror}; the figures are in {SUMMARY}{old}"]
    if told:
        print(f"report:     {path}")
    return []
