"""What became of a run's faults, as a person reads it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.results.figures import aligned, figure, small

_LEDGER = (
    "fault", "kind", "place", "acted", "seen by", "after", "expected", "touched", "refused", "let through",
    "at the fix", "fixes", "",
)  # fmt: skip


def faults(s: Mapping[str, Any]) -> list[str]:
    """What became of the run's faults, as lines of a table; none without faults."""
    if not s.get("faults"):
        return []
    several = len(s["craft"]) > 1
    return ["", *aligned([_LEDGER, *(fault_cells(row, several) for row in s["faults"])]).splitlines()]


def fault_cells(row: Mapping[str, Any], several: bool = False) -> tuple[str, ...]:
    """A fault of the ledger: name, kind, place, when it acted, by which check it was seen first, after how
    many epochs, the same of those that were expected to, frames touched, refused and let through, error at
    the fix, share of epochs with a fix, verdict.

    several   whether there are several craft: then it says whose
    """
    name = f"{row['craft']} {row['fault']}" if several else row["fault"]
    frames = row["frames"]
    head = (name, row["kind"], row["place"])
    if row["first_epoch"] is None:
        return (*head, "never", *(["-"] * 8), fault_verdict(row))
    return (
        *head,
        f"{row['first_epoch']}..{row['last_epoch']}",
        row["detected_by"] or "nothing",
        "-" if row["after_epochs"] is None else figure(row["after_epochs"]),
        _expected(row),
        *(figure(frames[key]) for key in ("touched", "refused", "let_through")),
        _at_the_fix(row),
        f"{100 * row['availability']:.3g} %",
        fault_verdict(row),
    )


def _expected(row: Mapping[str, Any]) -> str:
    """Which of the checks that were expected to see it did first, and after how many epochs; "-" where none
    was expected to."""
    if not any(one["key"] == "detected_by" for one in row["expectations"]):
        return "-"
    return f"{row['expected_by']} {row['expected_after_epochs']}" if row["expected_by"] else "nothing"


def _at_the_fix(row: Mapping[str, Any]) -> str:
    """The worst error of a fix; one that is not known may be worse than any."""
    if row.get("fixes_unjudged"):
        return "unknown"
    return "-" if row["fix_error_m"] is None else f"{small(row['fix_error_m'])} m"


def fault_verdict(row: Mapping[str, Any]) -> str:
    """What became of what was expected of a fault; "" where nothing was."""
    return "" if not row["expectations"] else "met" if row["met"] else "MISSED"


def idle(s: Mapping[str, Any]) -> list[str]:
    """One line for each fault that never acted and of which nothing was expected."""
    return [
        f"fault {_called(row)} never acted: its window, trigger or place never came"
        for row in s.get("faults", ())
        if row["first_epoch"] is None and not row["expectations"]
    ]


def clipped(s: Mapping[str, Any]) -> list[str]:
    """One line for each fault that asked for values that no bits can carry."""
    return [
        f"fault {_called(row)}: {so_many(row['frames']['clipped'], 'value')} led out of what the signal can "
        "carry; the nearest that it can was sent"
        for row in s.get("faults", ())
        if row["frames"]["clipped"]
    ]


def _called(row: Mapping[str, Any]) -> str:
    return f"'{row['fault']}' ({row['place']}, craft {row['craft']})"


def fault_missed(row: Mapping[str, Any]) -> list[str]:
    """One line for each expectation of a fault that was not met; one if it never acted."""
    if row["first_epoch"] is None and row["expectations"]:
        return [f"fault {_called(row)} never acted: nothing of what was expected of it is met"]
    return [
        f"expectation missed: fault {_called(row)}: {one['key']}: {one['found']}, expected {one['expected']}"
        for one in row["expectations"]
        if not one["met"]
    ]
