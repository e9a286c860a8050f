"""What the emulator writes beside the bus: the truth, and what faults did."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gnss_hil.emulator.faults import ledger
from gnss_hil.emulator.faults.engine import Event, FaultPlan

FLUSH_S = 1.0


class TruthLog:
    """Truth as it happens: one JSON line {"dtype": ..., "craft": [names]}, then raw rows of that dtype.

    Rows reach the file at least once a second of wall time, which the caller tells.
    """

    def __init__(self, path: Path | None, dtype: np.dtype, craft: Sequence[str]):
        self._file = open(os.devnull if path is None else path, "wb")  # noqa: SIM115
        header = {"dtype": np.lib.format.dtype_to_descr(dtype), "craft": list(craft)}
        self._file.write(json.dumps(header).encode() + b"\n")
        self._flushed_s = -FLUSH_S

    def __enter__(self) -> TruthLog:
        return self

    def __exit__(self, *_) -> None:
        self._file.close()

    def add(self, rows: np.ndarray, now_s: float) -> None:
        self._file.write(rows.tobytes())
        if now_s - self._flushed_s >= FLUSH_S:
            self._file.flush()
            self._flushed_s = now_s


class FaultLog:
    """What faults did, as it happens, where there are any: the lines of `gnss_hil.emulator.faults.ledger`.

    They reach the file at least once a second of wall time, which the caller tells.
    """

    def __init__(self, path: Path | None, plans: Sequence[FaultPlan]):
        self._file = open(os.devnull if path is None or not plans else path, "w")  # noqa: SIM115
        self._file.write(ledger.header(plans) if plans else "")
        self._flushed_s = -FLUSH_S

    def __enter__(self) -> FaultLog:
        return self

    def __exit__(self, *_) -> None:
        self._file.close()

    def add(self, events: Sequence[Sequence[Event]], now_s: float) -> None:
        """Events of an epoch, of each craft."""
        for craft, some in enumerate(events):
            self._file.write("".join(ledger.line(craft, event) for event in some))
        if now_s - self._flushed_s >= FLUSH_S:
            self._file.flush()
            self._flushed_s = now_s
