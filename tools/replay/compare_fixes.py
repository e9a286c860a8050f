"""The fixes of another flight software held against those recorded, epoch by epoch.

Another program's frames are never those of the record, bit for bit: its heartbeats, satellites and digits
are its own. What it makes of the same measurements can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.tools.decoder.block import of_frames
from gnss_hil.tools.decoder.navigation import fixes
from gnss_hil.tools.replay.compare import Comparison

SIGMAS = 5.0
"""Fixes differ if they are farther apart than this many of both published standard deviations together."""


@dataclass(frozen=True, slots=True, eq=False)
class _Fix:
    """position_m (3,); sigma_m: root sum square of the published ones, nan where there are none."""

    position_m: F64
    sigma_m: float


@dataclass(slots=True)
class FixComparison:
    """different: epochs in which only one has a fix, or both have and they contradict each other; none where
    every frame is as recorded."""

    codec: Codec
    frames: Comparison
    epochs: int = 0
    only_recorded: int = 0
    only_heard: int = 0
    contradicting: int = 0
    first: str = ""
    apart_m: list[float] = field(default_factory=list)

    @property
    def different(self) -> int:
        return self.only_recorded + self.only_heard + self.contradicting if self.frames.different else 0

    def add(self, number: int, recorded: FrameBatch, heard: FrameBatch) -> None:
        self.epochs += 1
        self.frames.add(number, recorded, heard)
        before, now = self._fix(recorded), self._fix(heard)
        if before is None and now is None:
            return
        if now is None:
            self.only_recorded += 1
            self._note(number, "no fix where one is recorded")
        elif before is None:
            self.only_heard += 1
            self._note(number, "a fix where none is recorded")
        else:
            apart_m = float(np.linalg.norm(now.position_m - before.position_m))
            self.apart_m.append(apart_m)
            sigma_m = float(np.sqrt(np.nansum(np.square([before.sigma_m, now.sigma_m]))))
            if apart_m > SIGMAS * sigma_m:
                self.contradicting += 1
                self._note(number, f"{apart_m:.3g} m apart, {sigma_m:.2g} m is one sigma of both")

    @property
    def result(self) -> str:
        """What came of it, for people."""
        if not self.frames.different:
            return self.frames.result
        both = len(self.apart_m)
        text = f"fixes in {so_many(both, 'epoch')} of both"
        if both:
            median, p95 = np.percentile(self.apart_m, (50, 95))
            text += (
                f", {median:.3g} m apart in the median, {p95:.3g} m p95, {max(self.apart_m):.3g} m at most"
            )
        for count, words in (
            (self.only_recorded, "in the recording alone"), (self.only_heard, "in the answer alone"),
            (self.contradicting, f"more than {SIGMAS:g} sigma apart"),
        ):  # fmt: skip
            text += f"; {count} {words}" if count else ""
        return f"{text}{f', first in {self.first}' if self.first else ''}"

    def _note(self, number: int, words: str) -> None:
        self.first = self.first or f"epoch {number}: {words}"

    def _fix(self, frames: FrameBatch) -> _Fix | None:
        known = (frames.can_id <= SFF_MASK) & (self.codec.kind_of[frames.can_id & SFF_MASK] >= 0)
        found = fixes(of_frames(self.codec, frames[known]))
        if not found["valid"][0]:
            return None
        sigma_m = float(np.sqrt(sum(float(found[f"sigma_{axis}_m"][0]) ** 2 for axis in "xyz")))
        return _Fix(np.array([found[f"{axis}_m"][0] for axis in "xyz"]), sigma_m)
