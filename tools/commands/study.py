"""`gnss-hil study`: many runs of one scenario, compared."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from pathlib import Path

from gnss_hil.dbc.process.command_line import seconds, whole
from gnss_hil.tools.common.errors import PROGRAM
from gnss_hil.tools.common.whole_file import draft_of

SCENARIO = "pair"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    from gnss_hil.emulator.error_models.registry import FACTORS

    add = parser.add_argument
    add("which", choices=["factors"], metavar="factors", help="one error factor at a time, on two craft")
    add(
        "scenario", nargs="?", default=SCENARIO, metavar="SCENARIO",
        help=f"shipped scenario or .toml file with two craft (default {SCENARIO})",
    )  # fmt: skip
    add("--duration", type=seconds, metavar="S", help="simulated time (default: the scenario's)")
    add("--interval", type=seconds, metavar="S", help="time between epochs (default: the scenario's)")
    add(
        "--factor", action="append", choices=FACTORS, metavar="FACTOR",
        help=f"only this one; repeatable (default: all): {', '.join(FACTORS)}",
    )  # fmt: skip
    add("--jobs", type=whole(1, 64), default=2, metavar="N", help="runs at a time (default 2)")
    add(
        "--out", type=Path, metavar="DIR",
        help="a new folder for the results (default runs/study-factors-<date>-<time>)",
    )  # fmt: skip
    add("--force", action="store_true", help="overwrite the results of an earlier study in DIR")
    add("--quiet", action="store_true", help="no progress")


def run(arguments: Namespace) -> int:
    import json

    from gnss_hil.emulator.error_models.registry import FACTORS
    from gnss_hil.tools.common.places import check_new_folder, make_folder
    from gnss_hil.tools.recording.run_folder import default_path
    from gnss_hil.tools.study import page
    from gnss_hil.tools.study.factors import ALONE, Effect, figures
    from gnss_hil.tools.study.runs import Job, play_all

    folder = arguments.out or default_path("study-factors")
    if not arguments.force:
        check_new_folder(folder, forceable=True)
    ready = [name for name, row in FACTORS.items() if row.ready]
    names = [ALONE, *dict.fromkeys(arguments.factor or ready)]
    jobs = [
        Job(arguments.scenario, name, turned, arguments.duration, arguments.interval)
        for name in names
        for turned in (False, True)
    ]
    # Every mistake, and every remark, before the first run.
    remarks = [remark for job in jobs[::2] for remark in job.plan().world.remarks]
    for remark in dict.fromkeys(remarks):
        print(f"{PROGRAM}: {remark}", file=sys.stderr)
    make_folder(folder)
    found = play_all(jobs, arguments.jobs, None if arguments.quiet else sys.stderr)
    effects = [Effect(name, *found[2 * k : 2 * k + 2]) for k, name in enumerate(names)]
    rows = figures(effects)
    print(page.text(rows))
    target = folder / "factors.html"
    page.write(effects, rows, jobs[0].about(), target)
    with draft_of(folder / "factors.json") as draft:
        draft.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    print(f"\nstudy: {target}")
    return 0
