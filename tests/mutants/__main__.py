"""Plays the mutants: each is put into a copy of the checkout, and the tests of its row must catch it.

    python -m tests.mutants [PACKAGE or ID ...] [--jobs N] [--write]

Exit status 0 if all were caught, 1 otherwise: a mutant survived, hung without leave, could not be played, or
the tests do not pass on the code as it stands.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

from tests.mutants.table import PACKAGES, SCORES, Mutant, faults, rows
from tests.mutants.workspace import FAILED, PASSED, Hung, Workspace, made

KILLED, SURVIVED, HUNG, BROKEN = "killed", "SURVIVED", "HUNG", "BROKEN"

SECONDS = 300.0
"""For the tests of a row, and for each of all together: a guard against what hangs, not a judgement."""


def main() -> int:
    options = _arguments().parse_args()
    known = rows()
    if wrong := list(faults(known)):
        print("\n".join(wrong))
        return 1
    chosen = [m for m in known if not options.of or {m.id, m.package} & set(options.of)]
    if not chosen:
        print(f"no mutant and no package of the name {' '.join(options.of)}")
        return 1
    with tempfile.TemporaryDirectory(prefix="gnss-hil-mutants-") as folder:
        workspaces = [made(Path(folder) / str(job)) for job in range(options.jobs)]
        if not _sound(workspaces[0], chosen):
            return 1
        verdicts = _played(workspaces, chosen)
    scores = _scores(chosen, verdicts)
    for package, (killed, of) in scores.items():
        print(f"{package}: {killed} of {of} killed")
    if options.write:
        if options.of:
            print("scores are those of all mutants: --write takes no choice")
            return 1
        SCORES.write_text(_table(scores), "utf-8")
    return 0 if all(verdict == KILLED for verdict in verdicts) else 1


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__.split("\n")[0])
    parser.add_argument("of", nargs="*", metavar="PACKAGE or ID", help="these alone; default: all")
    parser.add_argument("--jobs", type=int, default=1, help="so many at a time; default: 1")
    parser.add_argument("--write", action="store_true", help=f"write the scores into {SCORES.name}")
    return parser


def _sound(workspace: Workspace, mutants: Sequence[Mutant]) -> bool:
    """Whether the tests pass without a mutant: else they would tell nothing."""
    tests = sorted({test for mutant in mutants for test in mutant.tests})
    status, output = workspace.test(tests, len(tests) * SECONDS)
    if status != PASSED:
        print(f"{output}\nthe tests do not pass on the code as it stands")
    return status == PASSED


def _played(workspaces: Sequence[Workspace], mutants: Sequence[Mutant]) -> list[str]:
    """The verdict on each, printed as they come."""
    free: SimpleQueue[Workspace] = SimpleQueue()
    for workspace in workspaces:
        free.put(workspace)

    def play(mutant: Mutant) -> str:
        workspace = free.get()
        try:
            verdict, say = verdict_on(workspace, mutant)
        finally:
            free.put(workspace)
        print(f"{verdict:9}{mutant.package:9} {mutant.id}{say}", flush=True)
        return verdict

    with ThreadPoolExecutor(len(workspaces)) as pool:
        return list(pool.map(play, mutants))


def verdict_on(workspace: Workspace, mutant: Mutant) -> tuple[str, str]:
    """What became of a mutant, and what there is to say of it."""
    with workspace.mutated(mutant):
        try:
            status, output = workspace.test(mutant.tests, SECONDS)
        except Hung as error:
            return (KILLED, f": hangs, {mutant.hangs}") if mutant.hangs else (HUNG, f": {error}")
    if status == PASSED:
        return SURVIVED, f": {mutant.why}"
    if status != FAILED:
        return BROKEN, f": pytest ended with status {status}\n{output}"
    return KILLED, ""


def _scores(mutants: Sequence[Mutant], verdicts: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Killed and played mutants of each package."""
    of = Counter(mutant.package for mutant in mutants)
    killed = Counter(m.package for m, verdict in zip(mutants, verdicts, strict=True) if verdict == KILLED)
    return {package: (killed[package], of[package]) for package in PACKAGES if of[package]}


def _table(scores: dict[str, tuple[int, int]]) -> str:
    head = "# Written by `python -m tests.mutants --write`: mutants killed, of those played.\n"
    return head + "".join(
        f"\n[{package}]\nkilled = {killed}\nof = {of}\n" for package, (killed, of) in scores.items()
    )


if __name__ == "__main__":
    sys.exit(main())
