"""Recordings read, python-can and asammdf in the same run: `python -m tests.benchmarks.recordings [N]`.

Files are written by python-can where it is quick enough to write them, else by ourselves; each is read three
times, the best counts. Nothing fails on a time.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np

from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.tools.recording.formats.piece import Piece
from gnss_hil.tools.recording.formats.recording import Channels, Recording, format_of, open_writer

START_US = 1_351_642_484_000_000
ROUNDS = 3
THEIRS = 100_000
"""Frames that python-can is given to read: its pace does not depend on how many there are."""


def piece(n: int) -> Piece:
    """Frames of one bus, every 200 us, with payloads of a counter and noise."""
    rng = np.random.default_rng(1)
    data = rng.integers(0, 256, (n, WIDTH), np.uint8)
    data[:, :4] = np.arange(n, dtype="<u4").view(np.uint8).reshape(n, 4)
    can_id, length = (np.arange(n) % 250).astype(np.uint32), np.full(n, WIDTH, np.uint8)
    frames = FrameBatch(np.zeros(n, np.int64), can_id, length, data)
    stamps = START_US + 200 * np.arange(n)
    return Piece(stamps, np.full(n, b"can0", "S15"), frames, np.zeros(n, bool))


def written(folder: Path, suffix: str, n: int) -> Path:
    path = folder / f"{n}{suffix}"
    writer = open_writer(path, format_of(path), Channels())
    writer.write(piece(n))
    writer.close()
    return path


def frames_a_second(read: Callable[[], int]) -> float:
    """The best of the rounds."""
    best = 0.0
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        n = read()
        best = max(best, n / (time.perf_counter() - begin))
    return best


def _ours(path: Path) -> int:
    return sum(len(piece.frames) for piece in Recording(path).pieces())


def _python_can(path: Path) -> int:
    with can.LogReader(path) as messages:
        return sum(1 for _ in messages)


def _asammdf(path: Path) -> int:
    """Payloads, identifiers and times as arrays, which is what asammdf is good at."""
    import asammdf

    with asammdf.MDF(path) as measured:
        signal = measured.get("CAN_DataFrame", group=0)
        return len(signal.samples["CAN_DataFrame.DataBytes"])


def report(n: int) -> None:
    print(f"frames/s, {n} frames       ours  python-can  ratio     asammdf  ratio")
    with tempfile.TemporaryDirectory() as folder:
        for suffix in (".log", ".asc", ".blf", ".mf4"):
            path, few = written(Path(folder), suffix, n), written(Path(folder), suffix, min(n, THEIRS))
            ours = frames_a_second(lambda path=path: _ours(path))
            theirs = frames_a_second(lambda few=few: _python_can(few))
            arrays = frames_a_second(lambda path=path: _asammdf(path)) if suffix == ".mf4" else None
            line = f"{suffix:<20}{ours:>15.0f}{theirs:>12.0f}{ours / theirs:>7.1f}"
            print(line + (f"{arrays:>12.0f}{ours / arrays:>7.1f}" if arrays else ""))


if __name__ == "__main__":
    report(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
