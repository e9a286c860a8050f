"""What each check saw, epoch by epoch: frames, nodes, time marks, commands, what is left out and why there is
no fix.

By the bus alone, and by the same rule for anybody's software: the protection is checked again here, and what
the flight software alone can know is what it publishes: what it refused, what it left out of a fix, and why
it has none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, SFF_MASK
from gnss_hil.dbc.contract.messages import messages
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.decoder.flight_checks import LACKS, UNNAMED, names_of
from gnss_hil.tools.decoder.refusals import REASONS as FRAME_REASONS
from gnss_hil.tools.results import outages
from gnss_hil.tools.results.parquet import Columns, Labelled, Partial

SILENCE, RESTART, MARK = "SILENCE", "RESTART", "MARK"
NO_ANSWER, OTHER_ANSWER = "NO_ANSWER", "OTHER_ANSWER"
"""A node that was heard before has no frame that could be used; a heartbeat has another boot count; a time
mark is missing, goes back or jumps; a command is sent again because nothing answered it; an answer names
another satellite than its command."""

LOST = Verdict.LOST.name
REJECTIONS = tuple(name for name in FRAME_REASONS if name not in (Verdict.OK.name, LOST))
"""Checks by which frames are refused; LOST is the frame after a gap, which is used."""

EXCLUDED_SATELLITE, EXCLUDED_RECEIVER, UNHEALTHY = "EXCLUDED_SATELLITE", "EXCLUDED_RECEIVER", "UNHEALTHY"
"""Left out of a fix because it contradicts the others, or the orbit before; a satellite that says it is
unhealthy is measured and in no fix."""

FLIGHT, TIME, BENCH = "FLIGHT", "TIME", "BENCH"

SAID = tuple(VALUES["Refused"].values())
"""Reasons for which the flight software says that it refused something."""

LACKING = tuple(name.upper() for name in LACKS)
"""What the flight software says that it does without."""

CHECKS = tuple(dict.fromkeys((
    LOST, *REJECTIONS, SILENCE, RESTART, MARK, NO_ANSWER, OTHER_ANSWER, BENCH, UNHEALTHY, *outages.REASONS,
    EXCLUDED_SATELLITE, EXCLUDED_RECEIVER, *SAID, *LACKING,
)))  # fmt: skip
"""All that a check may be called; reasons that the contract does not name are UNKNOWN_ and the number."""


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Of one source, (k,): rows of the run's time marks (-1 before the first), checks, where, how often.

    by      who saw it: the bench, in the record, or the flight software, by its own word
    ahead   (k,) by how many epochs behind that of the mark, whose own marks are missing or not believed
    """

    row: I64
    check: NDArray[np.str_]
    where: NDArray[np.str_]
    count: I64
    by: str = BENCH
    ahead: I64 | int = 0


def columns(craft: str, digest: Digest, bench_refused: Sequence[Sequence[int]] = ()) -> Columns:
    """The rows of checks.parquet of one craft in the order of epochs, those before the first mark first:
    craft, t_gps_s, epoch (as its mark says, or by the marks around), check, where (message, identifier,
    satellite, receiver, or node), count, by (BENCH, FLIGHT)."""
    found = [*_sources(digest), _bench(digest, bench_refused)]
    row, check, where, count = (
        np.concatenate([getattr(rows, name) for rows in found]) for name in ("row", "check", "where", "count")
    )
    by = np.repeat([rows.by for rows in found], [len(rows.row) for rows in found])
    ahead = np.concatenate([np.broadcast_to(rows.ahead, len(rows.row)) for rows in found])
    t_ns, epoch = _when(digest, row, ahead)
    order = np.lexsort((epoch, row))
    return {
        "craft": Labelled(np.zeros(len(row), np.uint8), (craft,)),
        "t_gps_s": np.where(t_ns < 0, np.nan, t_ns / NS_PER_S)[order],
        "epoch": Partial(epoch[order], epoch[order] >= 0),
        "check": check[order],
        "where": where[order],
        "count": count[order],
        "by": by[order],
    }


def _when(digest: Digest, row: I64, ahead: I64) -> tuple[I64, I64]:
    """(k,) instants [ns], -1 where there is none, and numbers of epochs, -1 before the first mark."""
    t_ns, epoch = digest.marks["t_ns"], reckoned(digest.marks["epoch"])
    number, heard_ns = np.r_[epoch, -1][row] + np.where(row >= 0, ahead, 0), np.r_[t_ns, -1][row]
    if not ahead.any():
        return heard_ns, number
    t_of = dict(zip(epoch.tolist(), t_ns.tolist(), strict=True))
    own = np.array([t_of.get(one, -1) for one in number.tolist()], np.int64)
    return np.where(ahead > 0, own, heard_ns), number


def reckoned(epoch: I64) -> I64:
    """Numbers of epochs (n,) as their marks say, -1 where no mark does: there by those around, if as many are
    missing as there is room for; behind the last mark by it."""
    known = np.flatnonzero(epoch >= 0)
    if not len(known) or len(known) == len(epoch):
        return epoch
    row = np.arange(len(epoch))
    before = known[np.maximum(np.searchsorted(known, row, side="right") - 1, 0)]
    after = known[np.minimum(np.searchsorted(known, row), len(known) - 1)]
    guess = epoch[before] + row - before
    fits = (row > before) & ((after < row) | (epoch[after] - epoch[before] == after - before))
    return np.where((epoch < 0) & fits, guess, epoch)


def _sources(digest: Digest) -> Iterator[_Rows]:
    frames = digest.refused
    reason = np.array(FRAME_REASONS)[frames["reason"]]
    yield _Rows(frames["row"], reason, _names(digest.codec, frames["can_id"]), frames["frames"])
    names = np.array(digest.nodes.names)
    for check, nodes in ((SILENCE, digest.nodes.silent), (RESTART, digest.nodes.restarted)):
        yield _rows(nodes["row"], check, names[nodes["node"]])
    yield _rows(_jumps(**digest.marks), MARK, TIME)
    yield _unmarked(digest)
    yield _unanswered(digest)
    yield _answered_otherwise(digest)
    yield _unhealthy(digest)
    yield _without_fix(digest)
    yield _said(digest)
    yield _left_out(digest)
    yield _lacks(digest)


def _bench(digest: Digest, refused: Sequence[Sequence[int]]) -> _Rows:
    """Bench frames that were not believed: epochs, and how many in each."""
    row_of = {epoch: row for row, epoch in enumerate(digest.marks["epoch"].tolist())}
    known = [(row_of[epoch], count) for epoch, count in refused if epoch in row_of]
    row, count = np.array(known, np.int64).reshape(-1, 2).T
    return _rows(row, BENCH, BENCH, count)


def _unmarked(digest: Digest) -> _Rows:
    """Epochs without a mark of which several nodes sent frames; of one alone they may be of another time."""
    several = digest.unmarked["senders"] > 1
    row, ahead = (digest.unmarked[name][several] for name in ("row", "ahead"))
    return replace(_rows(row, MARK, TIME), ahead=ahead)


def _unhealthy(digest: Digest) -> _Rows:
    """Satellites that say they are unhealthy, are measured and in no fix, by epoch; count: channels."""
    of = digest.unhealthy
    key, count = np.unique(np.stack([of["row"], of["sat"]]), axis=1, return_counts=True)
    return _rows(key[0], UNHEALTHY, _satellites(key[1]), count)


def _said(digest: Digest) -> _Rows:
    """What the flight software refused, as it says itself."""
    said = digest.said
    reason = np.array([VALUES["Refused"].get(raw, f"UNKNOWN_{raw}") for raw in said["reason"].tolist()], str)
    where = _names(digest.codec, said["identifier"].astype(np.uint32))
    return _Rows(said["row"], reason, where, said["count"], FLIGHT, said["ahead"])


def _left_out(digest: Digest) -> _Rows:
    """Satellites and receivers that the flight software left out of its fixes; FLIGHT where it cannot be told
    which."""
    out = digest.left_out
    check = np.where(out["receiver"], EXCLUDED_RECEIVER, EXCLUDED_SATELLITE)
    return _Rows(out["row"], check, _excluded(out), out["count"], FLIGHT)


def _lacks(digest: Digest) -> _Rows:
    """What the flight software says that it does without."""
    of = digest.lacks
    return _rows(of["row"], np.array(LACKING)[of["which"]], FLIGHT, by=FLIGHT)


def _excluded(out: Mapping[str, NDArray]) -> NDArray[np.str_]:
    """Names of what was left out of fixes (k,); FLIGHT where it cannot be told which."""
    return np.where(out["which"] == UNNAMED, FLIGHT, names_of(out))


def _satellites(sat: NDArray[np.integer]) -> NDArray[np.str_]:
    return np.array([satellites.name(one) for one in sat.tolist()], str)


def _rows(
    row: NDArray[np.integer],
    check: str | NDArray,
    where: str | Sequence[str] | NDArray,
    count: I64 | int = 1,
    by: str = BENCH,
) -> _Rows:
    """Rows (k,), of which what is the same in all may be given once."""
    check, where = (np.broadcast_to(np.asarray(one, str), len(row)) for one in (check, where))
    return _Rows(row.astype(np.int64), check, where, np.broadcast_to(count, len(row)).astype(np.int64), by)


def _counted(counts: Mapping[tuple[int, str], int], check: str) -> _Rows:
    """Rows of a check by row of the marks and by where."""
    row, where = np.array([row for row, _ in counts], np.int64), [where for _, where in counts]
    return _rows(row, check, where, np.array(list(counts.values()), np.int64))


def _jumps(t_ns: I64, epoch: I64) -> I64:
    """Rows of marks (n,) that do not follow the one before by an epoch, and by the usual time of one."""
    known = np.flatnonzero((t_ns >= 0) & (epoch >= 0))
    if len(known) < 2:
        return np.zeros(0, np.int64)
    steps, spans_ns = np.diff(epoch[known]), np.diff(t_ns[known])
    usual_ns = np.median(spans_ns[steps == 1]) if (steps == 1).any() else spans_ns[0]
    return known[1:][(steps != 1) | (spans_ns != usual_ns)]


def _unanswered(digest: Digest) -> _Rows:
    """Commands that the flight software sends again, by epoch and receiver."""
    events = digest.commands.events
    row_of = {t: row for row, t in enumerate(digest.marks["t_ns"].tolist())}
    repeats = Counter(
        (row_of[t], f"RX{receiver}")
        for t, receiver, event in zip(events["t_ns"], events["receiver"], events["event"], strict=True)
        if event == "repeat"
    )
    return _counted(repeats, NO_ANSWER)


def _answered_otherwise(digest: Digest) -> _Rows:
    """Answers that name another satellite than the command of their number, by epoch and receiver."""
    events = digest.commands.events
    names = ("t_ns", "event", "action", "receiver", "channel", "transaction", "satellite")
    row_of = {t: row for row, t in enumerate(digest.marks["t_ns"].tolist())}
    asked: dict[tuple[int, int, int], str] = {}
    found: Counter[tuple[int, str]] = Counter()
    for t, event, action, *key, satellite in zip(*(events[name] for name in names), strict=True):
        receiver, channel, number = key
        if event == "ack":
            if satellite != asked.get((receiver, channel, number), satellite):
                found[row_of[t], f"RX{receiver}"] += 1
        elif action == "TRACK":
            asked[receiver, channel, number] = satellite
        else:
            asked.pop((receiver, channel, number), None)
    return _counted(found, OTHER_ANSWER)


def _without_fix(digest: Digest) -> _Rows:
    """Epochs without a fix, and why."""
    fixes, timeline = digest.fixes, digest.timeline
    row = np.flatnonzero(digest.marks["t_ns"] >= 0)[outages.without_fix(timeline, fixes)]
    t_ns = digest.marks["t_ns"][row].tolist()
    said = dict(zip(fixes["t_ns"].tolist(), fixes["no_fix"], strict=True)) if fixes else {}
    why = np.full(len(row), outages.SILENT, object)
    reported = np.array([t in said for t in t_ns], bool)
    why[reported] = outages.reason_names(np.array([said[t] for t in t_ns if t in said]))
    return _rows(row, why.astype(str), FLIGHT, by=FLIGHT)


def _names(codec: Codec, can_id: NDArray[np.uint32]) -> NDArray[np.str_]:
    """Names of the messages that identifiers (k,) have, or the identifiers in hex."""
    known = {message.can_id: message.name for message in messages(codec.receivers)}
    found, place = np.unique(can_id, return_inverse=True)
    return np.array([_name(int(identifier), known) for identifier in found], str)[place]


def _name(can_id: int, known: dict[int, str]) -> str:
    if can_id & EFF_FLAG:
        return f"0x{can_id & EFF_MASK:08X}"
    return known.get(can_id & SFF_MASK, f"0x{can_id & SFF_MASK:03X}")
