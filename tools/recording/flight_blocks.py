"""The flight software's frames of a run as they come, cut into its blocks where it closes them.

A flight block ends with BENCH_DONE{epoch, count}: the last `count` frames of that node before it. An epoch
answered twice (its BENCH_SYNC was repeated) counts once, wherever the second answer arrives.
"""

from __future__ import annotations

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.decoder.block import EPOCHS
from gnss_hil.tools.decoder.decoder import HELD_BACK


class FlightBlocks:
    """Blocks of one flight node, and what they say of themselves.

    pending    frames that no block has claimed yet
    answered   the last epoch that was answered, -1 before the first
    answers    epochs that were closed with DONE
    declared   frames that the blocks on record declare
    late       answers that came two epochs after their own or later
    lost       of those, answers so late that they are left out: their frames say the epoch modulo 16 only
    miscounts  answers whose DONE says another number of frames than came;  miscount  the first: epoch, said,
               came
    """

    def __init__(self, codec: Codec):
        self._codec = codec
        self._heartbeat = codec.kinds["HEARTBEAT"].number
        self._closed: list[FrameBatch] = []
        self.pending: list[FrameBatch] = []
        self.answered = -1
        self.answers = self.declared = self.late = self.lost = self.miscounts = 0
        self.miscount = (0, 0, 0)

    def take_closed(self) -> list[FrameBatch]:
        """Frames of blocks that were closed since, in order; they are asked for once."""
        closed, self._closed = self._closed, []
        return closed

    def unclaimed(self, start: bool) -> list[FrameBatch]:
        """What is pending, without announcements, at the start or later."""
        return [self._without_announcements(piece, start) for piece in self.pending]

    def close(self, epoch: int, count: int, at: int, ended: bool) -> None:
        """A block is whole: of an epoch, of so many frames, while epoch `at` is open or the run has ended. Of
        an epoch answered before it is the same again, and not kept."""
        block = concat(self.pending)
        self.pending = []
        first = max(len(block) - count, 0)
        before, block = block[:first], block[first:]
        before = self._without_announcements(before, start=not self.answers)
        if not ended:
            self._closed.append(before)
        if epoch <= self.answered:
            return
        self.answered = epoch
        self._check_count(epoch, count, len(block) + self._strays_of(epoch, before, block))
        self.answers += 1
        behind = at - epoch
        self.late += behind > messages.NEAR
        if behind < HELD_BACK:
            self._closed.append(block)
            self.declared += count
        else:
            self.lost += 1

    def _strays_of(self, epoch: int, before: FrameBatch, block: FrameBatch) -> int:
        """Frames before a block that are of its epoch and intact, and not the block said once already."""
        whole = before[(before.can_id <= SFF_MASK) & (before.data[:, 1] >> 4 == epoch % EPOCHS)]
        whole = whole[e2e.crc(whole.can_id, whole.data) == whole.data[:, 0]]
        said = {*zip(block.can_id.tolist(), block.words.tolist(), strict=True)}
        return sum(one not in said for one in zip(whole.can_id.tolist(), whole.words.tolist(), strict=True))

    def _check_count(self, epoch: int, said: int, came: int) -> None:
        if came != said:
            self.miscount = self.miscount if self.miscounts else (epoch, said, came)
            self.miscounts += 1

    def _without_announcements(self, frames: FrameBatch, start: bool) -> FrameBatch:
        """Without the heartbeats by which a node that waits announces itself, at the start all there are,
        later those whose counter and epoch are 0. How many there are depends on wall time."""
        beats = self._codec.kind_of[frames.can_id & SFF_MASK] == self._heartbeat
        return frames[~(beats & (start | (frames.data[:, 1] == 0)))]
