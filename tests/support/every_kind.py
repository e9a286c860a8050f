"""An hour of every fault of the library in turn, at ten epochs a second: is memory flat, what is lost?

    python -m tests.support.every_kind [--hours 1] [--out DIR] [--bus embedded]

The library's files follow each other, each its window after the one before, again and again until the time is
over. The bench plays them with processes of its own on a bus; their memory is read while they run. In the end
the frames that left no trace are compared with those that faults took out.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import polars
import tomli_w

from gnss_hil.emulator.faults import files
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.kinds.row import RUN
from tests.support.programs import GNSS_HIL
from tests.support.runs import children_of, summary_of

FIRST_S, EACH_S, LASTS_S = 120.0, 40.0, 8.0


def able(link: str) -> list[str]:
    """Files of the library that a link can do."""
    every = ((name, files.load(files.FILES.find(name))) for name in files.shipped())
    return [name for name, file in every if all(link in KINDS[one.kind].links for one in file.fault)]


def turns(duration_s: float, link: str = RUN, each_s: float = EACH_S) -> list[tuple[float, str]]:
    """When each file's turn begins [s], for as long as there is time for it."""
    count = int((duration_s - FIRST_S) // each_s)
    names = able(link)
    return [(FIRST_S + k * each_s, names[k % len(names)]) for k in range(count)]


def faults(given: Sequence[tuple[float, str]]) -> str:
    """A fault file of turns."""
    tables = []
    for begin_s, name in given:
        for table in tomllib.loads(files.FILES.find(name).read_text("utf-8"))["fault"]:
            table.pop("expect", None)
            tables.append(table | {"at": f"@{begin_s:g}+{LASTS_S:g}"})
    return tomli_w.dumps({"fault": tables})


def resident_mb(pid: int) -> float:
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * 4096 / 2**20


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--bus", default="embedded")
    given = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as scratch:
        out = given.out or Path(scratch) / "run"
        written = Path(scratch) / "faults.toml"
        written.write_text(faults(turns(given.hours * 3600)), "utf-8")
        command = [
            *GNSS_HIL, "run", "soyuz", "--interval", "0.1", "--duration", f"{given.hours:g}h", "--no-report",
            "--bus", given.bus, "--faults", str(written), "--out", str(out), "--quiet",
        ]  # fmt: skip
        begun_s, bench = time.monotonic(), subprocess.Popen(command)
        seen: dict[str, list[tuple[float, float]]] = {}
        while bench.poll() is None:
            for name, pid in {"recorder": bench.pid, **children_of(bench.pid)}.items():
                seen.setdefault(name, []).append((time.monotonic() - begun_s, resident_mb(pid)))
            time.sleep(1.0)
        return told(out, seen, bench.returncode)


def told(out: Path, seen: Mapping[str, Sequence[tuple[float, float]]], status: int) -> int:
    for name, rows in seen.items():
        half = rows[-1][0] / 2
        before = max(mb for at, mb in rows if at <= half)
        after = max(mb for at, mb in rows if at > half)
        print(f"{name:10s} {before:6.0f} MB at most in the first half, {after:6.0f} MB in the second")
    summary = summary_of(out)
    table = polars.read_parquet(out / "faults.parquet")
    print(f"{summary['epochs']} epochs, {len(table)} stretches of {table['kind'].n_unique()} kinds")
    print(f"frames: {summary['frames']}")
    print(f"status {status}")
    return status


if __name__ == "__main__":
    sys.exit(main())
