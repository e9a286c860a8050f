"""The frames of each identifier: counts by check, rate, age and the last frame."""

from __future__ import annotations

from collections import deque
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import ERR_FLAG, SFF_MASK, WIDTH, FrameBatch
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.tools.decoder.screen import Screen
from gnss_hil.tools.decoder.time_marks import Marks, marks_in

_FOREIGN = 256
"""Identifiers beyond the base format that have a row of their own; a bus can bring half a billion."""
_ROWS = IDENTIFIERS + _FOREIGN
RATE_WINDOW_S = 5.0


class BusStats:
    """Arrays by row: first 2048 base identifiers, then extended, remote and error frames as they come.

    counts      (rows, verdicts) frames by `Verdict`
    can_id      (rows,) with flag bits
    last_s, last_data, last_length, last_verdict   of the last frame
    unlisted    frames of strangers for which there was no row
    ended       BENCH_END was heard, and nothing of a run since
    """

    def __init__(self, codec: Codec):
        self._codec = codec
        self._screen = Screen(codec)
        self._session = -1
        self._end_id = codec.can_id_of["BENCH_END", 0]
        self._heartbeat = codec.kinds["HEARTBEAT"].number
        self._row_of_stranger: dict[int, int] = {}
        self._history: deque[tuple[float, NDArray]] = deque()
        self.counts = np.zeros((_ROWS, len(Verdict)), np.int64)
        self.can_id = np.arange(_ROWS, dtype=np.uint32)
        self.last_s = np.zeros(_ROWS)
        self.last_data = np.zeros((_ROWS, WIDTH), np.uint8)
        self.last_length = np.zeros(_ROWS, np.uint8)
        self.last_verdict = np.zeros(_ROWS, np.uint8)
        self.unlisted = 0
        self.ended = False

    def hear(self, frames: FrameBatch, now_s: float) -> NDArray[np.uint8]:
        """Frames (n,) in bus order; (n,) verdicts. Never raises on what a bus may carry."""
        marks = marks_in(self._codec, frames)
        starts = [0, *self._sessions(marks), len(frames)]
        pieces = (frames[begin:end] for begin, end in pairwise(starts))
        verdict = np.concatenate([self._verdict(piece, anew=k > 0) for k, piece in enumerate(pieces)])
        rows = self._rows(frames.can_id)
        listed = rows >= 0
        self.unlisted += int((~listed).sum())
        rows = rows[listed]
        np.add.at(self.counts, (rows, verdict[listed]), 1)
        self.last_s[rows] = now_s
        self.last_data[rows] = frames.data[listed]
        self.last_length[rows] = frames.length[listed]
        self.last_verdict[rows] = verdict[listed]
        ends = np.flatnonzero(frames.can_id == self._end_id)
        if len(ends) or len(marks.rows):
            self.ended = ends.max(initial=-1) > marks.rows.max(initial=-1)
        return verdict

    def _sessions(self, marks: Marks) -> list[int]:
        """Rows at which another session begins: who hears one forgets the counters (docs/contract.md)."""
        begins = []
        for row, session in zip(marks.rows.tolist(), marks.session.tolist(), strict=True):
            if session != self._session and self._session >= 0:
                begins.append(row)
            self._session = session
        return begins

    def _verdict(self, frames: FrameBatch, anew: bool) -> NDArray[np.uint8]:
        if anew:
            self._screen.forget()
        screened = self._screen.take(frames)
        # Before the first epoch a node repeats one heartbeat, counter 0: no fault by the contract.
        again = np.flatnonzero(screened.verdict == Verdict.REPEATED)
        waiting = again[
            (self._codec.kind_of[frames.can_id[again]] == self._heartbeat) & (frames.data[again, 1] & 15 == 0)
        ]
        verdict = screened.verdict.copy()
        verdict[waiting] = int(Verdict.OK)
        return verdict

    def _rows(self, can_id: NDArray[np.uint32]) -> NDArray[np.int64]:
        """(n,) row of each frame, -1 for a stranger without one."""
        rows = can_id.astype(np.int64)
        for i in np.flatnonzero(can_id > SFF_MASK):
            key = int(can_id[i])
            key = ERR_FLAG if key & ERR_FLAG else key  # an error frame's identifier is its kind of error
            if key not in self._row_of_stranger and len(self._row_of_stranger) < _FOREIGN:
                row = self._row_of_stranger[key] = IDENTIFIERS + len(self._row_of_stranger)
                self.can_id[row] = key
            rows[i] = self._row_of_stranger.get(key, -1)
        return rows

    @property
    def heard(self) -> NDArray[np.int64]:
        """Rows of which anything was heard, by identifier, strangers last."""
        rows = np.flatnonzero(self.counts.any(axis=1))
        return rows[np.lexsort((self.can_id[rows], rows >= IDENTIFIERS))]

    @property
    def missing(self) -> int:
        """Frames that counters of their streams miss."""
        return self._screen.counters.lost

    @property
    def frames(self) -> int:
        return int(self.counts.sum()) + self.unlisted

    def faults(self) -> dict[Verdict, int]:
        """Frames that were not OK, by verdict, only those that occurred."""
        total = self.counts.sum(axis=0)
        return {v: int(total[v]) for v in Verdict if v != Verdict.OK and total[v]}

    def rates_hz(self, now_s: float) -> NDArray[np.float64]:
        """(rows,) frames a second of the last seconds; call it with every draw."""
        counts = self.counts.sum(axis=1)
        self._history.append((now_s, counts))
        while len(self._history) > 2 and self._history[1][0] <= now_s - RATE_WINDOW_S:
            self._history.popleft()
        then_s, before = self._history[0]
        return (counts - before) / (now_s - then_s) if now_s > then_s else np.zeros(len(counts))
