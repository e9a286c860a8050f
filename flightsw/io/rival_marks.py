"""Several time marks in a block: which frames are of another master than the one that counts.

Counters of two masters do not follow each other: by them alone marks are refused by turns, the true ones
too. Where one mark of the block follows from those before, and the block has frames of its epoch, it stands.
Frames of the mark's streams that say something else in that epoch, and marks of epochs of which the block has
no other frame, are refused, and move no counter. A mark that comes again, bit for bit, is left to the
counters; so is all where no mark follows.

Nothing is used because it is found here: what is left goes through the protection as ever.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from gnss_hil.dbc.common.arrays import I8, I64, Index
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import HEARTBEAT_BASE
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.io.block_layout import block_layout
from gnss_hil.flightsw.io.decode import mark_of
from gnss_hil.flightsw.io.frame_groups import MARK, group_table
from gnss_hil.flightsw.io.frame_statistics import Reason
from gnss_hil.flightsw.records.epoch import Mark

MOST = 8
"""Different frames of a stream and epoch; of more no mark is put together."""

Follows = Callable[[Mark], bool]


@dataclass(frozen=True, slots=True, eq=False)
class Rivals:
    """Frames of a block that are another master's: their rows (n,) and why (n,) they are refused."""

    rows: Index
    reason: I64


def rivals(codec: Codec, frames: FrameBatch, counters: I8, follows: Follows) -> Rivals | None:
    """Of received frames; None if there are none, the ordinary case.

    counters   last ones received
    follows    whether a mark is the one to be expected after those believed
    """
    if not block_layout(codec, frames.can_id).several_marks:
        return None
    intact = np.flatnonzero(screening.checked(codec, frames).verdict == Verdict.OK)
    can_id, epoch = frames.can_id[intact], frames.data[intact, 1] >> 4
    stream = [intact[can_id == codec.can_id_of[kind, 0]] for kind in MARK]
    at_home = set(epoch[~np.isin(intact, np.concatenate(stream)) & (can_id < HEARTBEAT_BASE)].tolist())
    nibble, words = frames.data[:, 1] >> 4, frames.words
    standing = {}
    for own in at_home:
        rows = [_different(words, these[nibble[these] == own]) for these in stream]
        found = _standing(codec, frames, rows, counters, follows)
        if found is not None:
            standing[own] = words[found].tolist()
    if not standing:
        return None
    others = [
        (row, Reason.JUMPED if nibble[row] in standing else Verdict.MIXED_EPOCH)
        for k, these in enumerate(stream)
        for row in these.tolist()
        if (nibble[row] in standing or nibble[row] not in at_home)
        and words[row] != standing.get(nibble[row], (None,) * len(MARK))[k]
    ]
    return Rivals(*np.array(sorted(others)).T) if others else None


def _different(words, rows: Index) -> list[int]:
    """Of rows of a block one for each payload, the first."""
    return [int(rows[i]) for i in sorted(np.unique(words[rows], return_index=True)[1].tolist())]


def _standing(
    codec: Codec, frames: FrameBatch, rows: Sequence[list[int]], counters: I8, follows: Follows
) -> list[int] | None:
    """The rows of the mark that stands, of frames of one epoch, in some rows for each stream: of those that
    follow the nearest, then that whose counters have advanced least, then the first."""
    if not all(0 < len(these) <= MOST for these in rows):
        return None
    marks = np.array(list(product(*rows))).T
    reader = group_table(codec).groups["mark"].reader
    values = reader.read(frames.words[marks].take(reader.frame, axis=0))
    advance = _advances(codec, frames, counters, marks)
    found = []
    for k, own in enumerate(marks.T.tolist()):
        mark = mark_of(values[:, k : k + 1], frames.data.item(own[0], 1) >> 4)
        if mark is not None and follows(mark):
            found.append((mark.epoch, int(advance[k]), own))
    return min(found)[-1] if found else None


def _advances(codec: Codec, frames: FrameBatch, counters: I8, marks: Index) -> I64:
    """(n,) how far counters have advanced to those of marks (3, n), together; what comes again is last."""
    ids = frames.can_id[marks[:, 0]]
    last = counters[codec.first_stream_of[ids]].astype(np.int64)[:, None]
    steps = np.where(last < 0, 1, ((frames.data[marks, 1] & 15) - last) % e2e.COUNTERS)
    return np.where(steps == 0, e2e.COUNTERS, steps).sum(axis=0)
