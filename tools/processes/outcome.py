"""What only the run itself knows of how it went."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.tools.recording.account import Counted, Heard


@dataclass(frozen=True, slots=True)
class Outcome:
    """epochs      played
    unanswered     epochs whose wall-clock limit passed
    wall_s         from the first epoch to the last
    latency_*_s    last measurement out to fix in, percentiles; None if there was no epoch
    frames_sent    by the senders' own count; None if not counted
    mark_late_s    at a pace: how long after its instant an epoch began, at most; None if not measured
    interrupted    ended before its time
    failure        why it broke off; "" if it did not
    heard, counted   by craft: on the bus, and by the sides themselves; empty without a bus or its protocols
    latency_histogram   (upper edge [ms], epochs) of bins, by duration; empty where not measured
    """

    epochs: int
    unanswered: int
    wall_s: float
    latency_p50_s: float | None
    latency_p99_s: float | None
    frames_sent: int | None
    interrupted: bool = False
    failure: str = ""
    latency_histogram: tuple[tuple[float, int], ...] = ()
    mark_late_s: float | None = None
    heard: tuple[Heard, ...] = ()
    counted: tuple[Counted, ...] = ()
