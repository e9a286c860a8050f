"""Size and SHA-256 of what a run left on record: whether a folder's files are still those of its run.

A log that was cut, a truth of another run beside it: figures that are made of them again would be of no run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from gnss_hil.tools.recording.provenance import sha256
from gnss_hil.tools.recording.run_folder import FAULTS, LOG, SCENARIO, TRUTH, vehicle_name


def of_record(folder: Path, craft: Sequence[str]) -> dict[str, dict[str, Any]]:
    """By name, each file of a run folder that the others are made of: bytes, sha256."""
    names = (LOG, TRUTH, FAULTS, SCENARIO, *(vehicle_name(craft, i) for i in range(len(craft))))
    return {name: _of(folder / name) for name in names if (folder / name).is_file()}


def changed(folder: Path, record: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """A line for each file that is not as the run left it."""
    for name, before in record.items():
        path = folder / name
        if not path.is_file():
            yield f"{name} of the run is missing"
            continue
        now = _of(path)
        if now == before:
            continue
        size, of = now["bytes"], before["bytes"]
        found = f"{size} bytes of {of}" if size < of else f"another SHA-256, {size} bytes, it had {of}"
        yield f"{name} is not as the run left it: {found}"


def _of(path: Path) -> dict[str, Any]:
    return {"bytes": path.stat().st_size, "sha256": sha256(path)}
