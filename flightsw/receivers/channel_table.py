"""All receivers' channels as one table: what each shall do, and what it acknowledged."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Bool, Index
from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.flightsw.measurement.signals import track_of

IDLE, AUTO, UNKNOWN = -1, -2, -3
"""What a channel does beside tracking: nothing, searching by itself, not known."""

NEVER = -(10**9)
"""An epoch before all others."""

NO_TRANSACTION = -1


@dataclass(frozen=True, slots=True, eq=False)
class ChannelTable:
    """(k,) arrays: channel c of antenna a is row a * width + c, `width` channels of the largest antenna. What
    is tracked is a track: satellite and signal as one number (`gnss_hil.flightsw.measurement.signals`).

    exists       whether the antenna has that channel
    target       what it shall do: a track, IDLE or AUTO
    held         what it last acknowledged; also UNKNOWN
    asked        what the last command asked for
    transaction  of the command under way; NO_TRANSACTION if there is none
    sent_epoch   of the last command
    repeated     whether it had been sent before
    not_before   epoch before which it is not commanded
    commanded    whether any channel of the table acknowledged a command
    paired       whether any is to track a second signal, or does; else tracks are satellites
    """

    width: int
    exists: Bool
    target: I64
    held: I64
    asked: I64
    transaction: I64
    sent_epoch: I64
    repeated: Bool
    not_before: I64
    commanded: bool
    paired: bool

    @property
    def antenna(self) -> I64:
        return np.arange(len(self.exists)) // self.width

    def rows(self, receiver: I64, channel: I64) -> tuple[I64, Bool]:
        """(n,) rows of channels by 0-based receiver and channel, and whether the table has them; the row of
        one that it does not have is 0."""
        return _rows(self.width, len(self.exists), receiver.tobytes(), channel.tobytes())

    def of_antennas(self, which: Bool) -> Bool:
        """(k,) channels of the antennas that `which` (antennas,) marks."""
        return np.repeat(which, self.width)

    def answered(self, rows: Index, accepted: Bool) -> ChannelTable:
        """After answers (n,) to the commands under way: a refused channel goes back to what it does."""
        held, target, transaction = self.held.copy(), self.target.copy(), self.transaction.copy()
        yes, no = rows[accepted], rows[~accepted]
        transaction[rows] = NO_TRANSACTION
        held[yes] = self.asked[yes]
        target[no] = np.maximum(held[no], AUTO)
        return replace(self._holding(held), target=target, transaction=transaction)

    def waiting_until(self, rows: Index, epoch: int) -> ChannelTable:
        """With rows that are not commanded before an epoch."""
        not_before = self.not_before.copy()
        not_before[rows] = epoch
        return replace(self, not_before=not_before)

    def forgotten(self, which: Bool) -> ChannelTable:
        """With channels that `which` (k,) marks, of which it is unknown what they do."""
        return self._holding(np.where(which & self.exists, UNKNOWN, self.held))

    def _holding(self, held: I64) -> ChannelTable:
        """With other channels held."""
        return replace(self, held=held, commanded=bool(held.max() >= IDLE))

    def measured(self, sat: I64, signal: I64) -> I64:
        """(n,) tracks of satellites by signals (n,), as far as channels are told apart by signals."""
        return track_of(sat, signal) if self.paired else sat

    def contradicts(self, rows: I64, track: I64) -> Bool:
        """(n,) whether a channel measures something else than it acknowledged and shall track."""
        held = self.held[rows]
        return (held == self.target[rows]) & (held != AUTO) & (held != track)

    def usable(self, rows: I64, track: I64) -> Bool:
        """(n,) whether a channel shall track that and acknowledged it, or was commanded for the first time
        and has not answered yet."""
        held = self.held[rows]
        tracking = (held == track) & (self.target[rows] == track)
        waiting = (held == AUTO) & (self.transaction[rows] != NO_TRANSACTION)
        return tracking | waiting

    def retargeted(self, target: I64) -> ChannelTable:
        """With other targets (k,). One dropped while its command was under way may have been reached: what
        the channel does is unknown."""
        overtaken = (self.transaction != NO_TRANSACTION) & (target != self.asked)
        return replace(
            self._holding(np.where(overtaken, UNKNOWN, self.held)),
            target=target,
            transaction=np.where(overtaken, NO_TRANSACTION, self.transaction),
            paired=bool(max(target.max(), self.held.max(), self.asked.max()) >= SATELLITES),
        )

    def due(self, epoch: int, resend_epochs: int) -> tuple[Index, Bool]:
        """Rows (n,) of channels to be commanded in this epoch, and which of them anew: the others are asked
        again, under the same transaction."""
        (rows,) = ((self.target != self.held) & (self.not_before <= epoch)).nonzero()
        if not len(rows):
            return rows, np.zeros(0, bool)
        anew = self.transaction[rows] == NO_TRANSACTION
        due = anew | (epoch - self.sent_epoch[rows] >= resend_epochs)
        return rows[due], anew[due]

    @property
    def unheeded(self) -> bool:
        """Whether a command is under way that had to be repeated."""
        return bool((self.repeated & (self.transaction != NO_TRANSACTION) & (self.target != self.held)).any())

    def sent(self, rows: Index, transaction: I64, epoch: int) -> ChannelTable:
        """After commands for the targets of rows (n,) in this epoch."""
        asked, numbers, sent_epoch = self.asked.copy(), self.transaction.copy(), self.sent_epoch.copy()
        repeated = self.repeated.copy()
        repeated[rows] = numbers[rows] != NO_TRANSACTION
        asked[rows], numbers[rows], sent_epoch[rows] = self.target[rows], transaction, epoch
        return replace(self, asked=asked, transaction=numbers, sent_epoch=sent_epoch, repeated=repeated)


@lru_cache(maxsize=64)
def _rows(width: int, channels: int, receivers: bytes, of_receiver: bytes) -> tuple[I64, Bool]:
    """Most epochs measure on the same channels as the one before."""
    receiver, channel = np.frombuffer(receivers, np.int64), np.frombuffer(of_receiver, np.int64)
    first = receiver * width
    inside = (first < channels) & (channel < width)
    rows = (first + channel) * inside
    for shared in (rows, inside):
        shared.setflags(write=False)
    return rows, inside


def searching(channels: I64) -> ChannelTable:
    """Every channel searches by itself; channels (m,) of each antenna."""
    width = int(channels.max())
    exists = (np.arange(width) < channels[:, None]).ravel()
    auto, never = np.full(len(exists), AUTO, np.int64), np.full(len(exists), NEVER, np.int64)
    none, no = np.full(len(exists), NO_TRANSACTION, np.int64), np.zeros(len(exists), bool)
    return ChannelTable(width, exists, auto, auto, auto, none, never, no, never, False, False)


def assigned(table: ChannelTable, permitted: I64, second: I64, measured: I64) -> I64:
    """Targets (k,) that realise permissions: a satellite stays on the channels it is on, others take the
    channels left, lowest first; a channel not needed is IDLE.

    permitted   (SATELLITES,) antenna each satellite is permitted on, -1 none
    second      (SATELLITES,) signal it is tracked by on a channel beside that of its first, 0 none
    measured    (k,) track that each channel measures, -1 none
    """
    paired = np.flatnonzero(second)
    occupant = np.where(table.target == AUTO, measured, table.target)
    target = np.where(table.exists, IDLE, AUTO)
    antenna_of = table.antenna
    for antenna in range(len(target) // table.width):
        wanted = set(np.flatnonzero(permitted == antenna).tolist())
        mine = paired[permitted[paired] == antenna]
        wanted.update(track_of(mine, second[mine]).tolist())
        free = []
        for row in np.flatnonzero(table.exists & (antenna_of == antenna)).tolist():
            track = int(occupant[row])
            if track in wanted:
                target[row] = track
                wanted.remove(track)
            else:
                free.append(row)
        for row, track in zip(free, sorted(wanted), strict=False):
            target[row] = track
    return target
