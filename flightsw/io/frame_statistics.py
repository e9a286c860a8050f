"""Frames that are not used: counted by reason and identifier, each reason with its consequence. So are nodes
that send none (TIMED_OUT), once an epoch at their heartbeat's identifier."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from gnss_hil.dbc.common.arrays import I64, U8, U32, Bool, Index, Ints
from gnss_hil.dbc.contract import screening
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.screening import Verdict


class Reason(IntEnum):
    """Why a frame that passed protection is not used, or is missed; numbered on from `screening.Verdict`."""

    NO_TIME_MARK = 16
    SURPLUS = 17
    INCOMPLETE = 18
    BAD_TIME_MARK = 19
    OTHER_SESSION = 20
    OTHER_CONTRACT = 21
    TIMED_OUT = 22
    CONTRADICTED = 23
    STREAM_NOT_VALID = 24
    JUMPED = 25
    NO_ORBIT = 26
    MOVED = 27
    TURNED = 28


REASONS = max(Reason) + 1

CONSEQUENCE: dict[int, str] = {
    **screening.CONSEQUENCE,
    Reason.NO_TIME_MARK: "frame ignored, the epoch has no time",
    Reason.SURPLUS: "frame ignored, the first of this epoch stands",
    Reason.INCOMPLETE: "frame ignored, the others of its group are missing; "
    "a STATUS: nothing came of channels that it counts",
    Reason.BAD_TIME_MARK: "frame ignored, its time mark names no time or another epoch",
    Reason.OTHER_SESSION: "frame ignored, no complete time mark of that session opens the block",
    Reason.OTHER_CONTRACT: "frame ignored, its node flies another contract",
    Reason.STREAM_NOT_VALID: "frame ignored, too little of its stream was sound of late",
    Reason.CONTRADICTED: "frame ignored, more receivers, or else a lower one, say something else",
    Reason.JUMPED: "frame ignored, its time does not follow from the marks before; the epoch has no other",
    Reason.NO_ORBIT: "channel ignored, where it says that its satellite is there is no orbit",
    Reason.MOVED: "channel ignored, its satellite reported something else before",
    Reason.TURNED: "attitude ignored, it is none or not to be turned to; the last one is turned on",
    Reason.TIMED_OUT: "no frame: the node closed nothing in an epoch; what it did not send is not used",
}


class Rejections:
    """Counts (REASONS, IDENTIFIERS), copied only when something is added."""

    def __init__(self, counts: I64):
        self.counts, self._own = counts, False

    def add(self, reason: Ints | U8, can_id: I64 | U32, which: Bool) -> None:
        if not which.any():
            return
        if not self._own:
            self.counts, self._own = self.counts.copy(), True
        reasons = np.broadcast_to(np.asarray(reason, np.int64), which.shape)
        np.add.at(self.counts, (reasons[which], can_id[which]), 1)

    def add_rows(self, reason: int, can_id: U32, rows: Index) -> None:
        """One for each of some rows of identifiers (n,)."""
        if not len(rows):
            return
        if not self._own:
            self.counts, self._own = self.counts.copy(), True
        np.add.at(self.counts[reason], can_id[rows], 1)


def no_rejections() -> I64:
    return np.zeros((REASONS, IDENTIFIERS), np.int64)


def rejection_table(codec: Codec, rejected: I64) -> list[tuple[str, str, int, str]]:
    """Rows (reason, where: identifier and sender, how many, consequence) of all that was counted."""
    name = {**{v.value: v.name for v in Verdict}, **{r.value: r.name for r in Reason}}
    return [
        (
            name[int(reason)],
            f"0x{int(can_id):03X} {codec.sender_of[can_id]}".rstrip(),
            int(rejected[reason, can_id]),
            CONSEQUENCE[int(reason)],
        )
        for reason, can_id in np.argwhere(rejected)
    ]
