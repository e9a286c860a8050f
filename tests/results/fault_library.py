"""The faults that ship, flown: python -m tests.results.fault_library [NAME ...]; docs/faults-library.md.

Each file flies in `soyuz` inline until as long behind its window as it lasts, and is judged by what it
expects. Kept is what was found, in docs/faults-library.json.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from math import ceil
from pathlib import Path
from typing import Any

from gnss_hil.emulator.faults import files
from gnss_hil.emulator.faults.grammar import line
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.kinds.row import RUN
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.tools.common.errors import Failed
from gnss_hil.tools.results import fault_verdicts
from gnss_hil.tools.results.assemble import antennas
from gnss_hil.tools.results.fault_text import fault_cells
from tests.results.kept import ROOT, commit
from tests.support.gateways import OURS, through
from tests.support.programs import GNSS_HIL

FILE = ROOT / "docs" / "faults-library.json"
_AFTER_S = 6
"""So much longer than the last epoch that is judged."""

LEAD = """# What the library does to our flight software

Written by `python -m tests.results.fault_library` and `make docs` from runs of every file that ships
([faults.md](faults.md#the-library)) in `soyuz`, inline, seed 1; do not edit. CI plays all of them
(`tests/system/test_fault_library.py`), each judged by what it expects. Expectations are set by what contract
and physics demand; the files say why.

Frames are refused by the protection, while the fault lasts and as long behind it; let through is what it
touched, came and was not refused: what checks of content ([integrity.md](integrity.md)) have to tell. The
worst fix is 3-D, against truth, over the same epochs: 1.0 m without a fault. Faults of commands act from the
first fix on, which has six satellites and errs by 47 m without a fault.
"""

HEADS = (
    "file", "fault", "expected", "seen by", "after epochs", "of those expected", "frames touched", "refused",
    "let through", "worst fix", "epochs with a fix",
)  # fmt: skip


def fault_of(name: str) -> Fault:
    """The fault of a shipped file."""
    (fault,) = files.load(files.shipped()[name]).fault
    return fault


def duration_s(fault: Fault) -> int:
    """Until as long behind its window as that lasts."""
    start_s = float(fault.at.start or 0)
    long_s = float(fault.at.length or 0) if fault.at.stop is None else float(fault.at.stop) - start_s
    return ceil(start_s + 2 * long_s) + _AFTER_S


def fly(name: str, folder: Path) -> dict[str, Any]:
    """What became of the fault of a shipped file, as summary.json has it; of one that a run cannot do,
    through a gateway. `folder` is new."""
    fault = fault_of(name)
    if RUN not in KINDS[fault.kind].links:
        return _through_a_gateway(name, fault, folder)
    command = [*GNSS_HIL, "run", "soyuz", "--bus", "inline", "--quiet", "--no-report", "--faults", name]
    more = ["--duration", str(duration_s(fault)), "--out", str(folder / "run")]
    done = subprocess.run([*command, *more], capture_output=True, text=True)
    if not (folder / "run" / "summary.json").exists():
        raise Failed(f"{name}: {done.stderr}")
    (row,) = json.loads((folder / "run" / "summary.json").read_bytes())["faults"]
    assert done.returncode == (not row["met"]), done.stderr
    return row


def _through_a_gateway(name: str, fault: Fault, folder: Path) -> dict[str, Any]:
    """Judged by the record of the emulator's bus, and by what the gateway did."""
    folder.mkdir(parents=True, exist_ok=True)
    through(folder, (name,), OURS, duration=duration_s(fault))
    shutil.copy(folder / "gateway" / "faults", folder / "run" / "faults")
    (row,) = fault_verdicts.rows(fault_verdicts.judge(folder / "run", [fault], antennas(folder / "run")))
    return row


def expected(fault: Fault) -> str:
    """What is expected of a fault, for people."""
    e, words = fault.expect, []
    if e.detected_by:
        limit = "" if e.within_epochs is None else f" within {e.within_epochs}"
        words.append(f"{' or '.join(e.detected_by)}{limit}")
    words += [f"fix to {e.fix_error_m:g} m"] if e.fix_error_m is not None else []
    words += [f"fixes {100 * e.availability:g} %"] if e.availability is not None else []
    return ", ".join(words)


def read() -> Mapping[str, Any]:
    """What is kept: commit, and rows by file."""
    return json.loads(FILE.read_text("utf-8")) if FILE.exists() else {"commit": "", "files": {}}


def page() -> str:
    """docs/faults-library.md."""
    kept = read()
    rows = [_line(HEADS), _line(["---"] * 4 + ["---:"] * 7), *_rows(kept["files"])]
    return "\n".join([LEAD, f"Flown of commit {kept['commit']}.\n", *rows, ""])


def _rows(found: Mapping[str, Any]) -> Iterator[str]:
    for name in files.shipped():
        fault = fault_of(name)
        head = (
            f"`{name}`",
            f"`{line(fault.model_copy(update={'expect': type(fault.expect)()}))}`",
            expected(fault),
        )
        if name not in found:
            yield _line((*head, "not flown yet", *([""] * 7)))
            continue
        _, _, _, _, by, after, of, *counts, error, share, _ = fault_cells(found[name])
        yield _line((*head, by, after, of, *counts, error, share))


def _line(cells) -> str:
    return "| " + " | ".join(cells) + " |"


def main(names: list[str]) -> int:
    """Fly all, or some; those that miss an expectation are told."""
    kept = dict(read()["files"]) if names else {}
    for name in names or files.shipped():
        with tempfile.TemporaryDirectory(prefix="fault-") as place:
            kept[name] = fly(name, Path(place))
        print(f"{name}: {'met' if kept[name]['met'] else 'MISSED'}", flush=True)
    ordered = {name: kept[name] for name in sorted(kept)}
    FILE.write_text(json.dumps({"commit": commit(), "files": ordered}, indent=1) + "\n", "utf-8")
    return any(not row["met"] for row in kept.values())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
