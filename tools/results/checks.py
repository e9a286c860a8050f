"""What each check saw, epoch by epoch: frames refused and missed, silent nodes, why there is no fix.

By the bus alone, and by the same rule for anybody's software: the protection is checked again here, and the
reasons of epochs without a fix are those that the flight software publishes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.e2e import Verdict
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, SFF_MASK
from gnss_hil.dbc.contract.messages import messages
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.decoder.refusals import REASONS as FRAME_REASONS
from gnss_hil.tools.results import outages
from gnss_hil.tools.results.parquet import Columns, Labelled

SILENCE = "SILENCE"
"""A node that was heard before has no frame in an epoch that could be used."""

LOST = Verdict.LOST.name
REJECTIONS = tuple(name for name in FRAME_REASONS if name not in (Verdict.OK.name, LOST))
"""Checks by which frames are refused; LOST is the frame after a gap, which is used."""

CHECKS = (LOST, *REJECTIONS, SILENCE, *outages.REASONS)
"""All that a check may be called; reasons that the contract does not name are UNKNOWN_ and the number."""

FLIGHT = "FLIGHT"


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Of one source, (k,): instants (-1 unknown), checks, where, how often."""

    t_ns: I64
    check: NDArray[np.str_]
    where: NDArray[np.str_]
    count: I64


def columns(craft: str, digest: Digest) -> Columns:
    """The rows of checks.parquet of one craft, by time, those of no known instant first: craft, t_gps_s,
    check, where (message, identifier, or node), count."""
    found = list(_sources(digest))
    t_ns, check, where, count = (
        np.concatenate([getattr(rows, name) for rows in found]) for name in _Rows.__slots__
    )
    order = np.argsort(t_ns, kind="stable")
    t_ns = t_ns[order]
    return {
        "craft": Labelled(np.zeros(len(t_ns), np.uint8), (craft,)),
        "t_gps_s": np.where(t_ns < 0, np.nan, t_ns / NS_PER_S),
        "check": check[order],
        "where": where[order],
        "count": count[order],
    }


def _sources(digest: Digest) -> Iterator[_Rows]:
    frames = digest.refused
    reason = np.array(FRAME_REASONS)[frames["reason"]]
    yield _Rows(frames["t_ns"], reason, _names(digest.codec, frames["can_id"]), frames["frames"])
    silent = digest.silences.rows
    once = np.ones(len(silent["t_ns"]), np.int64)
    yield _Rows(
        silent["t_ns"], np.full(len(once), SILENCE), np.array(digest.silences.nodes)[silent["node"]], once
    )
    yield _without_fix(digest)


def _without_fix(digest: Digest) -> _Rows:
    """Epochs without a fix, and why."""
    fixes, timeline = digest.fixes, digest.timeline
    t_ns = timeline.get("t_ns", np.zeros(0, np.int64))
    t_ns = t_ns[outages.without_fix(timeline, fixes)]
    why = np.full(len(t_ns), outages.SILENT, object)
    if fixes:
        known = {int(t): number for t, number in zip(fixes["t_ns"], fixes["no_fix"], strict=True)}
        reported = np.array([int(t) in known for t in t_ns], bool)
        why[reported] = outages.reason_names(np.array([known[int(t)] for t in t_ns[reported]]))
    return _Rows(t_ns, why.astype(str), np.full(len(t_ns), FLIGHT), np.ones(len(t_ns), np.int64))


def _names(codec: Codec, can_id: NDArray[np.uint32]) -> NDArray[np.str_]:
    """Names of the messages that identifiers (k,) have, or the identifiers in hex."""
    known = {message.can_id: message.name for message in messages(codec.receivers)}
    found, place = np.unique(can_id, return_inverse=True)
    return np.array([_name(int(identifier), known) for identifier in found], str)[place]


def _name(can_id: int, known: dict[int, str]) -> str:
    if can_id & EFF_FLAG:
        return f"0x{can_id & EFF_MASK:08X}"
    return known.get(can_id & SFF_MASK, f"0x{can_id & SFF_MASK:03X}")
