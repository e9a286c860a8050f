"""When a craft's receivers latch: the time mark of a bench whose own time is not exact.

The mark says a GPS time; the receivers latch when the clock that the mark was read from shows it. A clock
that is ahead shows it early. Whoever reads the mark as GPS time takes the craft for where it is then, eight
millimetres further along a low orbit for each microsecond.

    source      the contract's mark_clock   read from
    GPS         0                           GPS time, less the computer's error, which no one tells
    DOMAIN_k    k + 1                       the receivers' clock domain k, whose offset every fix finds
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gnss_hil.emulator.clocks.bounded_wander import ClockState


@dataclass(frozen=True, slots=True)
class Instant:
    """domain: the clock domain that marks are read from, -1 for GPS time; computer_s: error of the on-board
    computer's clock [s] in an epoch."""

    domain: int
    computer_s: Callable[[int], float]

    @property
    def source(self) -> int:
        """Value of the contract's table "MarkClock"."""
        return self.domain + 1

    def ahead_s(self, clocks: ClockState, epoch: int) -> float:
        """The mark minus the GPS time of the latch [s]."""
        return self.computer_s(epoch) if self.domain < 0 else float(clocks[0, self.domain])


def exact(epoch: int) -> float:
    """An on-board computer whose clock is GPS time."""
    return 0.0
