"""What the emulator writes beside the bus: the truth."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

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
