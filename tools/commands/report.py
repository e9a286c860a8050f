"""`gnss-hil report`: tables and summary of a run again, from bus.log and truth alone."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from pathlib import Path

from tools.errors import PROGRAM, Mistake


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("run", type=Path, metavar="RUN", help="run folder")


def run(arguments: Namespace) -> int:
    from tools.folder import LOG, SCENARIO
    from tools.results import assemble
    from tools.results.text import missed, render

    folder = arguments.run
    if not folder.is_dir():
        raise Mistake(f"{folder}: no such run folder")
    for name in (SCENARIO, LOG):
        if not (folder / name).is_file():
            reason = "; a run without a log cannot be reported again" if name == LOG else ""
            raise Mistake(f"{folder}: has no {name}{reason}")
    scenario, codecs = assemble.read_scenario(folder)
    craft = [c.name for c in scenario.craft]
    digests = assemble.from_log(folder, craft, codecs)
    facts = assemble.read_facts(folder) or assemble.guessed_facts(scenario, digests)
    summary = assemble.write(folder, facts, digests)
    print(render(summary))
    print()
    lines = draw(folder, facts, summary, digests) + missed(summary)
    for line in lines:
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return 1 if lines else 0


def draw(folder: Path, facts, summary, digests) -> list[str]:
    """report.html, its path on stdout; a line if it cannot be written: the figures are safe by then."""
    from tools.folder import SUMMARY
    from tools.page import report

    try:
        print(f"report:     {report.write(folder, facts, summary, digests)}")
    except OSError as error:
        where = error.filename or folder / report.REPORT
        return [f"{where}: {error.strerror}; the figures are in {SUMMARY}"]
    return []
