"""`gnss-hil run`: a scenario played from end to end, into a run folder."""

from __future__ import annotations

import argparse
import os
import sys
from argparse import Namespace
from pathlib import Path

from gnss_hil.tools.command_line.arguments import (
    add_changes,
    add_scenario,
    bus,
    overrides_of,
    pace,
    seconds,
    seeds,
)
from gnss_hil.tools.common.errors import PROGRAM, Failed, Mistake
from gnss_hil.tools.run_config.config import OURS, RunConfig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_scenario(parser)
    add_changes(parser)
    add = parser.add_argument
    add("--pace", type=pace, default="lockstep", metavar="P", help="lockstep (default), realtime, or xN")
    add(
        "--bus", type=bus, default="embedded", metavar="B",
        help="embedded (default): two processes on a bus of our own; embedded:PATH: the same, its socket "
        "where you say; inline: one process, fastest; socketcan:vcan0; or any python-can INTERFACE:CHANNEL",
    )  # fmt: skip
    add(
        "--flight", default=OURS, metavar="F",
        help="another flight software: a COMMAND to start, which finds its bus, vehicle file and craft in "
        "GNSS_HIL_BUS, GNSS_HIL_VEHICLE and GNSS_HIL_CRAFT; or external: one that you start yourself",
    )  # fmt: skip
    add(
        "--emulator", default=OURS, metavar="E",
        help="another emulator or receiver: a COMMAND to start, which finds besides these GNSS_HIL_SCENARIO, "
        "GNSS_HIL_PACE and GNSS_HIL_DURATION [s]; or external: one that you start yourself",
    )  # fmt: skip
    add(
        "--wait", type=seconds, metavar="S",
        help="wait for the first sign of the other side no longer than S (default 60; of an external one, "
        "without limit)",
    )  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="run folder (default runs/<scenario>-<date>-<time>)")
    add("--junit", type=Path, metavar="FILE", help="write the verdict as JUnit XML too")
    add(
        "--seeds", type=seeds, default=(), metavar="A:B",
        help="a run for each seed, 1:20, 1:20:5 or 3,5,8, and a table of them; their folders are in --out",
    )  # fmt: skip
    add("--no-log", action="store_true", help="no bus.log and no channels.parquet: for very long runs")
    add("--no-report", action="store_true", help="no report.html")
    add("--plain", action="store_true", help="one line of progress on a terminal too, not the live view")
    add("--quiet", action="store_true", help="no progress; the summary is printed all the same")


def config_of(a: Namespace) -> RunConfig:
    return RunConfig(
        a.scenario, overrides_of(a), a.pace, a.bus, a.flight, a.emulator, a.out, a.junit,
        log=not a.no_log, report=not a.no_report, plain=a.plain, quiet=a.quiet, command=a.command_line,
        seeds=a.seeds, wait_s=a.wait,
    )  # fmt: skip


def run(arguments: Namespace) -> int:
    """Plays it; what it showed on stdout; the exit status."""
    config = config_of(arguments)
    if config.junit is None:
        return _run(config, None)
    _check_junit(config.junit)
    from gnss_hil.tools.results.verdict import Verdict

    verdict = Verdict(config.junit, Path(config.scenario).stem, config.command)
    try:
        return _run(config, verdict)
    except BaseException as error:
        verdict.write_error(_words(error))
        raise


def _words(error: BaseException) -> str:
    """What an error is called in a verdict."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted"
    return str(error) or type(error).__name__


def _run(config: RunConfig, verdict) -> int:
    from gnss_hil.tools.run_config.combination import check_combination

    check_combination(config)
    return _run_seeds(config, verdict) if config.seeds else _run_one(config, verdict)


def _run_seeds(config: RunConfig, verdict) -> int:
    """A run for each seed, each with its report; a line for each, and the table."""
    from gnss_hil.tools.commands import report
    from gnss_hil.tools.common.places import check_new_folder
    from gnss_hil.tools.processes.run_session import Interruptible
    from gnss_hil.tools.recording.run_folder import default_path
    from gnss_hil.tools.results.figures import aligned
    from gnss_hil.tools.study import seeds as study

    folder = config.out or default_path(Path(config.scenario).stem)
    check_new_folder(folder)
    lines: list[str] = []
    rows: list[dict] = []
    stop = Interruptible()
    for seed, ran in study.play_each(config, folder, stop):
        if isinstance(ran, Failed):
            found = [str(ran)]
            if verdict:
                verdict.error_suite(seed, str(ran))
        else:
            found = study.wrong(ran)
            if config.report:
                found += report.draw(ran.folder, ran.facts, ran.summary, ran.digests, told=False)
            if verdict:
                verdict.suite(ran.summary, ran.folder, found)
            rows += study.rows(seed, ran, found)
            for note in ran.notes:
                print(f"{PROGRAM}: seed {seed}: note: {note}", file=sys.stderr)
        lines += [f"seed {seed}: {line}" for line in found]
    if rows:
        table = study.write(rows, folder)
        whole = f"{aligned(study.table(rows))}\n\nrun folders: {folder}\ntable:       {table}"
        print(whole, flush=True)
    lines += verdict.write_suites() if verdict else []
    for line in lines:
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return stop.status if stop() else 1 if lines else 0


def _run_one(config: RunConfig, verdict) -> int:
    from gnss_hil.tools.commands import report
    from gnss_hil.tools.processes import run_session
    from gnss_hil.tools.results.text import missed, render

    stop = run_session.Interruptible()
    ran = run_session.play(config, stop)
    if ran is None:
        print(f"{PROGRAM}: run: interrupted before the run began", file=sys.stderr)
        if verdict:
            verdict.write_error("interrupted before it began")
        return stop.status
    whole = f"{render(ran.summary)}\n\nrun folder: {ran.folder}"
    print(whole, flush=True)
    lines = [ran.outcome.failure] if ran.outcome.failure else []
    lines += ran.faults
    for note in ran.notes:
        print(f"{PROGRAM}: note: {note}", file=sys.stderr)
    if config.report:
        lines += report.draw(ran.folder, ran.facts, ran.summary, ran.digests)
    if verdict:
        ended = ["interrupted"] if ran.outcome.interrupted else []
        lines += verdict.write(ran.summary, ran.folder, [*lines, *ended])
    lines += [] if ran.outcome.interrupted else missed(ran.summary)
    for line in lines:
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return stop.status if ran.outcome.interrupted else 1 if lines else 0


def _check_junit(path: Path) -> None:
    """A verdict that could not be written is a mistake before the run, not after it."""
    if not path.absolute().parent.is_dir():
        raise Mistake(f"--junit {path}: no such folder {path.parent}")
    if path.is_dir():
        raise Mistake(f"--junit {path}: is a folder; name a file")
    if not os.access(path if path.exists() else path.absolute().parent, os.W_OK):
        raise Mistake(f"--junit {path}: cannot be written: Permission denied")
