"""Whether a run kept its pace."""

from __future__ import annotations

from gnss_hil.dbc.lockstep.master_loop import parse_pace
from gnss_hil.tools.processes.outcome import Outcome

_KEPT = 0.98
"""Share of its pace that a run has to reach."""

_ENDS_S = 1.0
"""Wall clock of a run that no pace rules: its first epoch, and the last answers."""


def notes(pace: str, interval_s: float, outcome: Outcome) -> list[str]:
    """A line if a run at a pace fell behind: its time marks came later than an epoch lasts, or it took longer
    than its pace allows; what it measures of latency and late answers then is the load, not the software."""
    factor = parse_pace(pace)
    if factor is None or not outcome.epochs or outcome.wall_s <= 0:
        return []
    period_s, late_s = interval_s / factor, outcome.mark_late_s or 0.0
    reached = outcome.epochs * interval_s / outcome.wall_s
    slow = outcome.wall_s - _ENDS_S > outcome.epochs * period_s / _KEPT
    if late_s <= period_s and not slow:
        return []
    kept = f"time marks came up to {late_s * 1e3:.3g} ms late, an epoch lasts {period_s * 1e3:.3g} ms"
    rate = f"reached {reached:.3g} times real time"
    return [
        f"overload: --pace {pace} was not kept: {kept}; {rate}; latencies and late answers are the load's"
    ]
