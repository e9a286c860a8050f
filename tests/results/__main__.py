"""Measure results: python -m tests.results [--quick] [--again] [NAME ...]"""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.results.kept import ROOT, commit, measured, read, write
from tests.results.readers import Played
from tests.results.table import RESULTS, Result

LAST = 4000  # characters of output that a failure shows
UNNAMED = "soyuz-DATE-TIME"  # a run's folder in what is shown, as it is called where none is named
BUSY = 1.0  # load average above which speeds are not measured


def shell_text(command: str, folder: Path, shown: bool = False) -> str:
    """The command as it is run: RUN is the folder, a run without --out goes there.

    shown   what it prints is to be kept; else it keeps quiet
    """
    added = "--out RUN" if shown else "--out RUN --quiet"
    lines = [
        f"{line} {added}" if line.startswith("gnss-hil run ") and "--out" not in line else line
        for line in command.splitlines()
    ]
    return "\n".join(lines).replace("RUN", shlex.quote(str(folder)))


def environment() -> dict[str, str]:
    """Ours with this Python's programs first, and a folder of data."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    data = os.environ.get("GNSS_HIL_DATA", str(ROOT.parent / "shared" / "data"))
    return {**os.environ, "PATH": path, "GNSS_HIL_DATA": data}


def play(command: str, folder: Path, shown: bool = False) -> Played:
    """Run a command to its end; RuntimeError if it fails."""
    log = folder.parent / "output"
    begun = time.monotonic()
    with log.open("w") as output:
        shell = subprocess.Popen(
            ["bash", "-euo", "pipefail", "-c", shell_text(command, folder, shown)],
            cwd=ROOT, env=environment(), stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        _, status, used = os.wait4(shell.pid, 0)
        shell.returncode = os.waitstatus_to_exitcode(status)
    text = log.read_text("utf-8", "replace")
    if shell.returncode:
        raise RuntimeError(f"exit status {shell.returncode}\n{text[-LAST:]}")
    return Played(
        folder, text, time.monotonic() - begun, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    )


def measure(result: Result) -> tuple[dict[str, float], str]:
    """Figures, and what the command printed with the folder it would have had without one."""
    with tempfile.TemporaryDirectory(prefix="results-") as place:
        folder = Path(place) / "run"
        played = play(result.command, folder, result.shown)
        figures = {name: reader(played) for name, reader in result.figures.items()}
        return figures, played.output.replace(str(folder), f"runs/{UNNAMED}") if result.shown else ""


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.results", description=__doc__)
    parser.add_argument("name", nargs="*", choices=[[], *RESULTS], metavar="NAME", help="only these")
    parser.add_argument("--quick", action="store_true", help="only what takes minutes")
    parser.add_argument("--again", action="store_true", help="also what this commit has measured already")
    return parser.parse_args()


def main() -> int:
    asked, now, failed = arguments(), commit(), []
    for name, result in RESULTS.items():
        before = read().get(name)
        done = before and before.commit == now and before.command == result.command and not asked.again
        if (asked.name and name not in asked.name) or (asked.quick and result.tier != "minutes") or done:
            continue
        print(f"{name} ...", end=" ", flush=True)
        load = os.getloadavg()[0]
        if result.idle and load > BUSY:
            print(f"not measured: it is a speed, and the machine is busy (load {load:.1f})")
            continue
        try:
            figures, output = measure(result)
        except (RuntimeError, ValueError, OSError, KeyError) as error:
            print(f"FAILED: {error}")
            failed.append(name)
            continue
        write({**read(), name: measured(result.command, figures, load, output)})
        print(", ".join(f"{figure} {value:.6g}" for figure, value in figures.items()))
    if failed:
        print(f"failed: {', '.join(failed)}")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
