"""Frames of a bus, counted: heard, lost, rejected by reason. One record for all that count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from gnss_hil.dbc.contract.screening import Screened, Verdict


@dataclass(slots=True)
class Counters:
    """Frames of one bus or of several.

    received  frames heard, rejected ones included
    lost      frames missing by the counters of their streams
    rejected  reason -> frames: a `Verdict`, or MIXED_EPOCH, BEFORE_FIRST_MARK
    """

    received: int = 0
    lost: int = 0
    rejected: Counter[str] = field(default_factory=Counter)

    def add(self, screened: Screened) -> None:
        """Frames that went through the protection checks."""
        self.received += len(screened.verdict)
        self.lost += screened.lost
        if len(screened.frames) < len(screened.verdict):
            for verdict, count in enumerate(np.bincount(screened.verdict)):
                if verdict > Verdict.LOST:
                    self.reject(Verdict(verdict).name, int(count))

    def reject(self, reason: str, frames: int) -> None:
        """Frames of those received that a later check refuses."""
        if frames:
            self.rejected[reason] += frames

    @property
    def reasons(self) -> dict[str, int]:
        """Rejected frames by reason, in order of their names, only reasons that occurred."""
        return {reason: count for reason, count in sorted(self.rejected.items()) if count}

    def figures(self, sent: int | None) -> dict[str, int | Mapping[str, int]]:
        """As in summary.json. `sent` is what the senders' bench frames declare. Where they declare nothing,
        or less than was received because one of them does not declare, it is what was received and what
        the counters of the streams miss."""
        if sent is None or sent < self.received:
            sent = self.received + self.lost
        lost = max(sent - self.received, self.lost)
        return {"sent": sent, "received": self.received, "lost": lost, "rejected": self.reasons}


def total(counted: Iterable[Counters]) -> Counters:
    """The frames of several buses."""
    whole = Counters()
    for counters in counted:
        whole.received += counters.received
        whole.lost += counters.lost
        for reason, frames in counters.reasons.items():
            whole.reject(reason, frames)
    return whole
