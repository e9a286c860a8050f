"""What a gateway hears, cut into epochs: what both directions have in common."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat

QUIET_S = 0.02
"""Silence behind which what no bench frame closes is complete."""


@dataclass(frozen=True, slots=True)
class Label:
    """Session and epoch: what names an epoch on the bus."""

    session: int
    epoch: int


@dataclass(frozen=True, slots=True)
class Piece:
    """Frames that are to leave.

    label    of the epoch whose frames of this direction they all are; None: they pass as they are
    closing  SYNC or DONE behind them, whose count is to say what leaves
    again    what left last is to leave again, behind them
    """

    frames: FrameBatch
    label: Label | None = None
    closing: FrameBatch = EMPTY
    again: bool = False


class Held:
    """Frames that wait, in order; when the last came."""

    def __init__(self) -> None:
        self.last_s = math.inf
        self._pieces: list[FrameBatch] = []

    def __bool__(self) -> bool:
        return bool(self._pieces)

    def keep(self, frames: FrameBatch, now_s: float) -> None:
        if len(frames):
            self._pieces.append(frames)
            self.last_s = now_s

    def only(self, can_id: int) -> bool:
        """Whether nothing else than one identifier waits."""
        return all((frames.can_id == can_id).all() for frames in self._pieces)

    def take(self) -> FrameBatch:
        frames = concat(self._pieces)
        self._pieces = []
        return frames
