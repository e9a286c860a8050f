"""The decoder of one bus: frames in pieces of any size in, epochs out.

Every frame is checked once (`screen`), put into the epoch that it names, and handed on with the frames of
its epoch, by kind (`block`). Only frames count here, never anything that emulator or flight software hold
inside, so a third party's software is measured by the same rule.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gnss_hil.dbc.common.arrays import I64, U8, U32, U64, Bool
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.tools.decoder.block import EPOCHS, Block, GrowingTable, epoch_nibbles, payloads
from gnss_hil.tools.decoder.counters import Counters
from gnss_hil.tools.decoder.refusals import BEFORE_FIRST_MARK, REASONS, Refusals
from gnss_hil.tools.decoder.screen import Screen
from gnss_hil.tools.decoder.time_marks import MARK_KINDS

HELD_BACK = 8
"""Epochs kept open: an answer may come so many epochs late, less one. Half of the sixteen that frames tell
apart."""

Held = tuple[U32, U64, I64]
"""Identifiers, payloads and epochs of accepted frames."""


class Decoder:
    """Decodes one bus.

    take     is handed every block in order, and (e,) bits on the wire and frames rejected of its epochs
    epochs   time marks heard so far
    refusals   what each check saw, by epoch
    doubted    time frames that their counters alone have refused: epoch, kind (its number), word
    unmarked   accepted frames of an epoch ahead of the last mark, whose own is missing: epoch (of the mark),
               ahead (by how many), can_id; each once
    """

    def __init__(self, codec: Codec, take: Callable[[Block, I64, I64], None]):
        self.codec = codec
        self.epochs = 0
        self.refusals = Refusals()
        self.doubted = GrowingTable()
        self.unmarked = GrowingTable()
        self._take = take
        self._screen = Screen(codec)
        self._mark_id, *self._time_ids = (codec.can_id_of[kind, 0] for kind in MARK_KINDS)
        self._mark_nibbles = np.zeros(0, np.int64)
        self._handed_over = 0  # epochs
        self._held: list[Held] = []
        self._counts = np.zeros((2, 0), np.int64)  # bits, rejected frames of the epochs still held

    @property
    def counters(self) -> Counters:
        return self._screen.counters

    def feed(self, frames: FrameBatch, bits: I64 | None = None) -> None:
        """More frames (n,) in bus order; their bits (n,) on the wire if they are known already."""
        if not len(frames):
            return
        screened = self._screen.take(frames)
        is_mark = frames.can_id == self._mark_id
        accepted = None
        if len(screened.frames) < len(frames):
            accepted = screened.verdict <= Verdict.LOST
            is_mark &= accepted
        words = payloads(frames)
        self._mark_nibbles = np.r_[self._mark_nibbles[-HELD_BACK:], epoch_nibbles(words[is_mark])]
        epoch = self.epochs - 1 + np.cumsum(is_mark)
        self.epochs = int(epoch[-1]) + 1
        self._count(0, epoch, frame_bits(frames) if bits is None else bits)
        can_id = frames.can_id
        if screened.lost:
            after_gap = screened.verdict == Verdict.LOST
            self.refusals.add(epoch[after_gap], Verdict.LOST, can_id[after_gap])
        if accepted is not None:
            self._reject(epoch[~accepted], screened.verdict[~accepted], can_id[~accepted])
            self._doubt(epoch, can_id, words, screened.verdict)
            can_id, words, epoch = can_id[accepted], words[accepted], epoch[accepted]
        self._hold(can_id, words, epoch)
        self._hand_over(self.epochs - HELD_BACK)

    def finish(self) -> None:
        """Hand over what is still held."""
        self._hand_over(self.epochs)

    def _doubt(self, epoch: I64, can_id: U32, words: U64, verdict: U8) -> None:
        """Keep frames of times whose counters are wrong and nothing else."""
        which = np.isin(can_id, self._time_ids) & np.isin(verdict, (Verdict.REPEATED, Verdict.WRONG_SEQUENCE))
        if which.any():
            kind = self.codec.kind_of[can_id[which]]
            self.doubted.add({"epoch": epoch[which], "kind": kind, "word": words[which]})

    def _reject(self, epoch: I64, reason: str | U8, can_id: U32) -> None:
        """Frames (n,) count as rejected: for verdicts (n,) of the screen, which has counted them, or for a
        reason that it does not know."""
        if isinstance(reason, str):
            self.counters.reject(reason, len(epoch))
            self.refusals.add(epoch, REASONS.index(reason), can_id)
        else:
            self.refusals.add(epoch, reason, can_id)
        self._count(1, epoch, np.ones(len(epoch), np.int64))

    def _count(self, row: int, epoch: I64, values: I64) -> None:
        """Add values (n,) to a count of their epochs; before the first epoch nothing is counted."""
        epochs = self.epochs - self._handed_over
        self._counts = np.pad(self._counts, ((0, 0), (0, epochs - self._counts.shape[1])))
        begun = epoch >= 0
        sums = np.bincount(epoch[begun] - self._handed_over, values[begun], minlength=epochs)
        self._counts[row] += sums.astype(np.int64)

    def _hold(self, can_id: U32, words: U64, epoch: I64) -> None:
        """Keep accepted frames with the epoch they belong to: the one they are in or one before."""
        if len(epoch) and epoch[0] < 0:
            begun = epoch >= 0
            self._reject(epoch[~begun], BEFORE_FIRST_MARK, can_id[~begun])
            can_id, words, epoch = can_id[begun], words[begun], epoch[begun]
        nibble = self._mark_nibbles[epoch - (self.epochs - len(self._mark_nibbles))]
        late = (nibble - epoch_nibbles(words)) % EPOCHS
        if late.any():
            strange = (late >= HELD_BACK) | (late > epoch)  # or of an epoch before the first
            self._note_unmarked(epoch, EPOCHS - late, can_id, late >= HELD_BACK)
            self._reject(epoch[strange], Verdict.MIXED_EPOCH.name, can_id[strange])
            keep = ~strange
            can_id, words, epoch = can_id[keep], words[keep], (epoch - late)[keep]
        self._held.append((can_id, words, epoch))

    def _note_unmarked(self, epoch: I64, ahead: I64, can_id: U32, which: Bool) -> None:
        rows = np.unique(np.stack([epoch[which], ahead[which], can_id[which].astype(np.int64)]), axis=1)
        self.unmarked.add(dict(zip(("epoch", "ahead", "can_id"), rows, strict=True)))

    def _hand_over(self, end: int) -> None:
        """All epochs before `end`."""
        if end <= self._handed_over:
            return
        can_id, words, epoch = (np.concatenate(parts) for parts in zip(*self._held, strict=True))
        ready = epoch < end
        open_yet = ~ready
        self._held = [(can_id[open_yet], words[open_yet], epoch[open_yet])]
        begin, self._handed_over = self._handed_over, end
        (bits, faults), self._counts = np.split(self._counts, [end - begin], axis=1)
        self._take(
            Block(self.codec, can_id[ready], words[ready], epoch[ready] - begin, end - begin), bits, faults
        )
