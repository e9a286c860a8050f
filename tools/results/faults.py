"""The ledger of faults of a run folder: faults.parquet, from the stream that the emulator wrote."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.emulator.faults import ledger
from gnss_hil.emulator.faults.ledger import Stretch
from gnss_hil.tools.recording.run_folder import FAULTS
from gnss_hil.tools.results import parquet

TABLE = "faults.parquet"


def read(folder: Path) -> tuple[list[dict[str, Any]], list[Stretch]]:
    """What was armed by craft, and the stretches in which it acted; nothing where there were no faults."""
    path = folder / FAULTS
    if not path.exists():
        return [], []
    with path.open(encoding="utf-8") as lines:
        armed, events = ledger.read(lines)
        return armed, ledger.stretches(events)


def write(folder: Path) -> None:
    """faults.parquet of faults that nothing judges, those of a gateway: a row for each stretch of epochs."""
    if not (folder / FAULTS).exists():
        return
    armed, rows = read(folder)
    parquet.write(folder / TABLE, [columns(armed, rows)])


def columns(armed: Sequence[dict[str, Any]], rows: Sequence[Stretch]) -> dict[str, parquet.Column]:
    """The table: craft, fault, kind, place, direction, active, first_epoch, last_epoch, epochs,
    frames_touched, frames_missing, values_clipped, first_struck."""
    of = [armed[row.craft]["faults"][row.fault] for row in rows]
    text = {
        "craft": [armed[row.craft]["craft"] for row in rows],
        "fault": [one["name"] for one in of],
        "kind": [one["kind"] for one in of],
        "place": [one["place"] for one in of],
        "direction": [row.direction.value for row in rows],
    }
    whole = {
        "first_epoch": [row.first for row in rows],
        "last_epoch": [row.last for row in rows],
        "epochs": [row.epochs for row in rows],
        "frames_touched": [row.touched for row in rows],
        "frames_missing": [row.missing for row in rows],
        "values_clipped": [row.clipped for row in rows],
    }
    struck = np.array([row.struck for row in rows], np.int64)
    return {
        **{name: np.array(values, str) for name, values in text.items()},
        "active": np.array([row.active for row in rows], bool),
        **{name: np.array(values, np.int64) for name, values in whole.items()},
        "first_struck": parquet.Partial(struck, struck >= 0),
    }
