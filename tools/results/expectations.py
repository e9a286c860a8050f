"""Whether a fault led to what was expected of it, by what acted, what was seen, and the fixes.

What was seen comes from the bus, by the words of `gnss_hil.emulator.faults.checks`: whoever decodes it hands
over the epochs in which each check saw something, and where.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.emulator.faults.ledger import Stretch
from gnss_hil.emulator.faults.models import Expect
from gnss_hil.tools.results.detectors import NEAREST, NOTHING, Sign

LEAST_BEFORE = 10
"""So many epochs before a fault have to be without a check's word for it to be the fault's, at least."""


@dataclass(frozen=True, slots=True, eq=False)
class Fixes:
    """Of epochs that the flight software answered (e,): number, whether there is a fix, and by how much that
    errs [m], nan where there is none or it is not known."""

    epoch: I64
    valid: Bool
    error_m: F64


@dataclass(frozen=True, slots=True)
class Finding:
    """What became of a fault: by which check it was seen first, and how many epochs after its first one, None
    if it was not; the same of the checks that were expected to see it; the largest error of a fix [m], nan
    without one; share of its epochs with a fix; how many fixes there are whose error is not known."""

    detected_by: str | None
    after_epochs: int | None
    fix_error_m: float
    availability: float
    fixes_unjudged: int = 0
    expected_by: str | None = None
    expected_after_epochs: int | None = None


@dataclass(frozen=True, slots=True)
class Verdict:
    """One expectation: its key, what was expected, what was found, whether it was met."""

    key: str
    expected: str
    found: str
    met: bool


def span(stretches: Sequence[Stretch], frames: bool = True) -> tuple[int, int] | None:
    """First and last epoch in which a fault acted within its windows; None if it never did.

    frames   whether its kind acts on frames
    """
    found = spans(stretches, frames)
    return (min(first for first, _ in found), max(last for _, last in found)) if found else None


def spans(stretches: Sequence[Stretch], frames: bool = True) -> list[tuple[int, int]]:
    """First and last epochs of the stretches in which a fault acted within its windows. If its kind acts on
    frames it begins where it first touched one: where there was none it did not act."""
    acting = [one for one in stretches if one.active and (one.touched or not frames)]
    return [(one.struck if frames else one.first, one.last) for one in acting]


def behind(first: int, last: int) -> int:
    """The last epoch that is still a fault's own: as long behind it as it lasted."""
    return last + (last - first + 1)


def finding(
    expect: Expect, stretches: Sequence[Stretch], fixes: Fixes, signs: Sequence[Sign], frames: bool = True,
    others: Sequence[tuple[int, int]] = (),
) -> Finding | None:  # fmt: skip
    """What became of a fault, from its stretches; None if it never acted.

    signs    what each check saw at the fault's places
    frames   whether the fault's kind acts on frames (`Row.frames`)
    others   first and last epochs of the other faults on its bus

    A check counts that says what is new, while the fault lasts or as long behind it; of several the first,
    and of those that come at once the one nearest to a cause.
    """
    found = span(stretches, frames)
    if found is None:
        return None
    first, last = found
    new = _newly(signs, first, last, others)
    by, after = _first_of(new, first)
    expected_by, expected_after = _first_of([one for one in new if one.word in expect.detected_by], first)
    fixed = np.unique(fixes.epoch[fixes.valid & (fixes.epoch >= first) & (fixes.epoch <= last)])
    near = (fixes.epoch >= first) & (fixes.epoch <= behind(first, last))
    known = np.isfinite(fixes.error_m)
    errors_m = fixes.error_m[near & known]
    return Finding(
        by,
        after,
        float(errors_m.max()) if len(errors_m) else float("nan"),
        len(fixed) / (last - first + 1),
        int((near & fixes.valid & ~known).sum()),
        expected_by,
        expected_after,
    )


def _newly(signs: Sequence[Sign], first: int, last: int, others: Sequence[tuple[int, int]]) -> list[Sign]:
    """Those that were quiet for as long before a fault as it lasted, but for the time of other faults, and
    did not go on from there; in its own epochs. Those nearest to a cause come first."""
    begin, until = first - max(LEAST_BEFORE, last - first + 1), behind(first, last)
    return [
        replace(one, epochs=one.epochs[one.epochs <= until])
        for one in sorted(signs, key=lambda one: NEAREST.index(one.word))
        if first - 1 not in one.epochs and not _unexplained(one.epochs, begin, first, others).any()
    ]


def _unexplained(epochs: I64, begin: int, end: int, others: Sequence[tuple[int, int]]) -> Bool:
    """(k,) which epochs are from one until before another, and of no other fault's time."""
    found = (epochs >= begin) & (epochs < end)
    for first, last in others:
        found &= (epochs < first) | (epochs > behind(first, last))
    return found


def _first_of(signs: Sequence[Sign], first: int) -> tuple[str | None, int | None]:
    """The word of the sign that came first, and how many epochs after a fault's first one."""
    times = {}
    for one in signs:
        epochs = one.epochs[one.epochs >= first]
        if len(epochs):
            times[one.word] = min(times.get(one.word, np.inf), int(epochs.min()) - first)
    by = min(times, key=lambda word: times[word]) if times else None
    return by, None if by is None else times[by]


def verdicts(expect: Expect, found: Finding | None) -> list[Verdict]:
    """Each expectation, met or not. A fault that never acted meets none."""
    rows: list[Verdict] = []
    if expect.detected_by:
        rows.append(_detection(expect, found))
    if expect.fix_error_m is not None:
        rows.append(_error(expect.fix_error_m, found))
    if expect.availability is not None:
        share = float("nan") if found is None else found.availability
        met = found is not None and share >= expect.availability
        rows.append(Verdict("availability", f">= {expect.availability:g}", _said(found, share), met))
    return rows


def _detection(expect: Expect, found: Finding | None) -> Verdict:
    limit = "" if expect.within_epochs is None else f" within {so_many(expect.within_epochs, 'epoch')}"
    expected = f"{' or '.join(expect.detected_by)}{limit}"
    if found is None:
        return Verdict("detected_by", expected, "never acted", False)
    if found.detected_by is None:
        return Verdict("detected_by", expected, "not seen", NOTHING in expect.detected_by)
    if found.expected_by is None:
        only = "" if expect.detected_by == (NOTHING,) else "only "
        return Verdict("detected_by", expected, only + _when(found.detected_by, found.after_epochs), False)
    after = found.expected_after_epochs
    met = expect.within_epochs is None or (after is not None and after <= expect.within_epochs)
    return Verdict("detected_by", expected, _when(found.expected_by, after), met)


def _when(by: str, after: int | None) -> str:
    return f"{by} after {so_many(after or 0, 'epoch')}"


def _error(limit_m: float, found: Finding | None) -> Verdict:
    """No fix is off by more: without a fix that is so, of one whose error is not known it is not."""
    worst_m, unjudged = (float("nan"), 0) if found is None else (found.fix_error_m, found.fixes_unjudged)
    met = found is not None and not worst_m > limit_m and not unjudged
    said = _said(found, worst_m)
    if unjudged and not worst_m > limit_m:
        said = f"not known of {so_many(unjudged, 'fix', 'fixes')}"
    return Verdict("fix_error_m", f"<= {limit_m:g}", said, met)


def _said(found: Finding | None, value: float) -> str:
    if found is None:
        return "never acted"
    return "no fix" if np.isnan(value) else f"{value:.4g}"
