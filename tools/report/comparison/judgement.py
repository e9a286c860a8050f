"""When a figure of one run is better or worse than the other's.

Only figures of the same flight are: the same craft on the same orbit under the same sky, with the same draws.
What the bench itself took, its times, is a matter of the machine and never judged.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gnss_hil.tools.report.comparison.runs import Run


def not_judged(first: Run, second: Run) -> str:
    """Why neither run can be better than the other, in a line; "" if one can."""
    if first.flight["craft"] != second.flight["craft"]:
        keys = ["craft"]
    else:
        keys = [key for key, value in first.flight.items() if value != second.flight.get(key)]
    if not keys:
        return ""
    said = ", ".join(key + _in_words(first.flight.get(key), second.flight.get(key)) for key in keys)
    return f"Nothing is judged better or worse: the runs are not of the same flight; they differ in {said}."


def _in_words(a: Any, b: Any) -> str:
    """What two runs have, if that is a word or two."""
    return f" ({a} / {b})" if isinstance(a, str | int) and isinstance(b, str | int) else ""


def another_length(first: Run, second: Run) -> str:
    """Why figures of the whole runs are not judged, in a line; "" if they are."""
    if same_length(first.summary, second.summary):
        return ""
    return (
        "The runs are not of the same length: judged are figures after convergence alone, since the first "
        "minute is another share of each run."
    )


def same_length(first: Mapping[str, Any], second: Mapping[str, Any]) -> bool:
    return all(first.get(key) == second.get(key) for key in ("epochs", "epoch_interval_s"))


_LESS_IS_BETTER = (
    "epochs_unanswered", "frames.lost", "frames.rejected", "no_fix", "first_fix_s", "outages", "pdop",
    "pdop_distinct", "position_error_m", "velocity_error_mps", "rejected",
)  # fmt: skip
_MORE_IS_BETTER = ("fixes", "satellites_tracked")
_ALIKE = 0.005
"""Share by which figures may differ and count as equal."""

_COUNTS = ("fixes", "no_fix", "outages", "frames", "rejected", "epochs_unanswered")
"""Figures that grow with a run; so do the greatest and the least of something."""
CONVERGED = "converged"


def is_of(name: str, keys: Sequence[str]) -> bool:
    """Whether a dotted name has one of the keys."""
    return any(f".{key}." in f".{name}." for key in keys)


def judged(name: str, a: float | None, b: float | None, same_length: bool = True) -> str:
    """Whether the second run's figure is "better" or "worse" than the first's; "" where they are alike, one
    is missing, or neither more nor less of it is better. Of runs of another length only figures after
    convergence are compared that do not grow with a run."""
    if a is None or b is None or abs(b - a) <= _ALIKE * max(abs(a), abs(b)):
        return ""
    grows = is_of(name, _COUNTS) or name.endswith((".max", ".min"))
    if not same_length and (grows or not is_of(name, (CONVERGED,))):
        return ""
    if is_of(name, _LESS_IS_BETTER):
        return "better" if b < a else "worse"
    if is_of(name, _MORE_IS_BETTER):
        return "better" if b > a else "worse"
    return ""
