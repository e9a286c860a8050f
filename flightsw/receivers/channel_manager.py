"""Arrow 9->1 of RU 2706636 C1: tracking permissions as channel commands, repeated until acknowledged.

A channel has a *target* (what it shall do) and is *held* at what was last acknowledged; a command is due
while the two differ. Both are a satellite index, IDLE or AUTO (searching by itself); what is held may also
be UNKNOWN. The rules:

- A satellite stays on the channel it is on. A channel not needed is released: its receiver stops searching.
- Handover: the old antenna's channel is released (or given another satellite) and the new antenna's channel
  is commanded in the same block. The new one has to acquire: the gap is counted in epochs.
- A command unanswered for `resend_epochs` is repeated under its transaction number. Retries count epochs.
- A refused satellite is left alone for `backoff_epochs`, by all antennas: the one whose angle is second
  smallest must not have it either. A channel that refuses by itself is left alone for as long.
- Measurements enter a fix only from a channel whose target is acknowledged; so none is used from two
  antennas, even when the release of the old one was lost and the tracking by the new one was not.
- What contradicts an acknowledgement (another satellite measured, a receiver restarted) makes the channel
  unknown again; it is commanded anew.
- Until the first acknowledgement the receivers' own choice is used; too long without a fix, it is again.

The price of the first assignment: receivers that search by themselves all measure the same half dozen
satellites. From one antenna each these are few (PDOP 28 instead of 14) or, with an oscillator in every
receiver and hence eight unknowns, too few: no fix for the half minute in which the new channels collect
ephemerides. Keeping the duplicates as long would bridge it, but one satellite on one antenna is what step 8
of the patent is about. So the gap stands, once in a flight; the position is carried on meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import GLONASS, NUMBERS, SATELLITES
from gnss_hil.flightsw.assignment.options import Options
from gnss_hil.flightsw.io.epoch import Acks, Measurements
from gnss_hil.flightsw.measurement.signals import NUMBER

IDLE, AUTO, UNKNOWN = -1, -2, -3
RELEASE, TRACK, AUTONOMOUS = 0, 1, 2
ACCEPTED = 0
CHANNEL_REFUSALS = (1, 7, 8)
"""NO_SUCH_CHANNEL, NO_SUCH_SIGNAL, BAD_ACTION: the channel's fault; all others are the satellite's."""
TRANSACTIONS = 4096
_LONG_AGO = -(10**9)


@dataclass(frozen=True, slots=True)
class Tally:
    """What came of it. sent: commands without repeats; refused (16,) by AckResult; gap_epochs: epochs between
    a satellite's last use on one antenna and its first on the next, over all handovers, and the longest."""

    sent: int
    repeated: int
    accepted: int
    refused: NDArray[np.int64]
    handovers: int
    gap_epochs: int
    gap_longest: int


@dataclass(frozen=True, slots=True)
class Commander:
    """State of all channels: (m, C) arrays, C channels of the largest antenna; `real` marks which exist.

    target, held   satellite index, IDLE, AUTO or (held only) UNKNOWN
    asked          what the last command asked for
    transaction    of the last command; -1 none
    sent_epoch     of the last command; commands wait until `not_before`
    permitted      (SATELLITES,) antenna each satellite is permitted on, -1 none
    blocked_until  (SATELLITES,) epoch until which a refused satellite is left alone
    stale          the targets have to be planned anew even if the permissions stay the same
    boots          (MAX_RECEIVERS,) last boot counts heard
    moving         (SATELLITES,) bool, in handover: permitted on another antenna, not yet in a fix from it
    used_epoch     (SATELLITES,) when a satellite was last in a fix
    """

    real: NDArray[np.bool_]
    target: NDArray[np.int64]
    held: NDArray[np.int64]
    asked: NDArray[np.int64]
    transaction: NDArray[np.int64]
    sent_epoch: NDArray[np.int64]
    not_before: NDArray[np.int64]
    permitted: NDArray[np.int64]
    blocked_until: NDArray[np.int64]
    stale: bool
    next_transaction: int
    boots: NDArray[np.int64]
    moving: NDArray[np.bool_]
    used_epoch: NDArray[np.int64]
    tally: Tally


@dataclass(frozen=True, slots=True)
class Commands:
    """Commands of one epoch: antenna, channel, action, sat, transaction, each (n,) int."""

    antenna: NDArray[np.int64]
    channel: NDArray[np.int64]
    action: NDArray[np.int64]
    sat: NDArray[np.int64]
    transaction: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.sat)


def fresh(channels: NDArray[np.int64], receivers: int) -> Commander:
    """Every channel searches by itself; channels (m,)."""
    real = np.arange(channels.max()) < channels[:, None]
    auto = np.full(real.shape, AUTO, np.int64)
    long_ago = np.full(real.shape, _LONG_AGO, np.int64)
    nowhere = np.full(SATELLITES, -1, np.int64)
    return Commander(
        real=real, target=auto, held=auto, asked=auto,
        transaction=np.full(real.shape, -1), sent_epoch=long_ago, not_before=long_ago,
        permitted=nowhere, blocked_until=np.full(SATELLITES, _LONG_AGO), stale=True, next_transaction=0,
        boots=np.full(receivers, -1, np.int64),
        moving=np.zeros(SATELLITES, bool), used_epoch=np.full(SATELLITES, _LONG_AGO),
        tally=Tally(0, 0, 0, np.zeros(16, np.int64), 0, 0, 0),
    )  # fmt: skip


def taken_over(c: Commander) -> bool:
    """Whether any channel acknowledged a command: from here on only acknowledged channels are used."""
    return bool((c.held >= IDLE).any())


def acknowledged(c: Commander, acks: Acks, epoch: int, options: Options) -> Commander:
    """After this epoch's answers. Answers to superseded commands, and to nobody's, say nothing."""
    if not len(acks.sat):
        return c
    inside = (acks.receiver < c.real.shape[0]) & (acks.channel < c.real.shape[1])
    at = acks.receiver[inside], acks.channel[inside]
    current = c.transaction[at] == acks.transaction[inside]
    at = at[0][current], at[1][current]
    result, sat = acks.result[inside][current], acks.sat[inside][current]
    yes = result == ACCEPTED
    held, target = c.held.copy(), c.target.copy()
    transaction, not_before, blocked = c.transaction.copy(), c.not_before.copy(), c.blocked_until.copy()
    transaction[at] = -1
    accepted = at[0][yes], at[1][yes]
    held[accepted] = c.asked[accepted]
    refused = at[0][~yes], at[1][~yes]
    target[refused] = np.maximum(held[refused], AUTO)
    by_channel = np.isin(result[~yes], CHANNEL_REFUSALS)
    not_before[refused[0][by_channel], refused[1][by_channel]] = epoch + options.backoff_epochs
    blocked[sat[~yes][~by_channel]] = epoch + options.backoff_epochs
    tally = replace(
        c.tally,
        accepted=c.tally.accepted + int(yes.sum()),
        refused=c.tally.refused + np.bincount(result[~yes], minlength=16),
    )
    return replace(
        c, held=held, target=target, transaction=transaction, not_before=not_before, blocked_until=blocked,
        stale=c.stale or not yes.all(), tally=tally,
    )  # fmt: skip


def contradicted(c: Commander, m: Measurements, boots: NDArray[np.int64]) -> Commander:
    """After comparing acknowledgements with what is measured, and boot counts with those before."""
    antennas, channels = c.real.shape
    restarted = (boots >= 0) & (c.boots >= 0) & (boots != c.boots)
    settled = c.held == c.target
    inside = (m.receiver < antennas) & (m.channel < channels)
    at = m.receiver[inside], m.channel[inside]
    wrong = settled[at] & (c.held[at] != AUTO) & (c.held[at] != m.sat[inside])
    if not wrong.any() and not restarted.any():
        return c if (boots == c.boots).all() else replace(c, boots=np.where(boots >= 0, boots, c.boots))
    held = c.held.copy()
    held[at[0][wrong], at[1][wrong]] = UNKNOWN
    held[restarted[:antennas]] = np.where(c.real[restarted[:antennas]], UNKNOWN, AUTO)
    return replace(c, held=held, stale=True, boots=np.where(boots >= 0, boots, c.boots))


def usable(c: Commander, m: Measurements) -> NDArray[np.bool_]:
    """(n,) measurements that may enter the fix: of satellites that channels were told to track and said they
    do, and of channels that have been told something for the first time and have not answered yet. After a
    restart the receivers refuse the first commands of streams whose counters happen to repeat."""
    inside = (m.receiver < c.real.shape[0]) & (m.channel < c.real.shape[1])
    if not taken_over(c):
        return inside
    at = np.where(inside, m.receiver, 0), np.where(inside, m.channel, 0)
    told = (c.held[at] == m.sat) & (c.target[at] == m.sat)
    waiting = (c.held[at] == AUTO) & (c.transaction[at] >= 0)
    return inside & (told | waiting)


def planned(c: Commander, permitted: NDArray[np.int64], m: Measurements) -> Commander:
    """With targets that realise the permissions (SATELLITES,): antenna of each satellite, -1 none."""
    if not c.stale and np.array_equal(permitted, c.permitted):
        return c
    observed = np.full(c.real.shape, -1, np.int64)
    inside = (m.receiver < c.real.shape[0]) & (m.channel < c.real.shape[1])
    observed[m.receiver[inside], m.channel[inside]] = m.sat[inside]
    occupant = np.where(c.target == AUTO, observed, c.target)
    target = np.full(c.real.shape, IDLE, np.int64)
    for antenna, row in enumerate(target):
        wanted = set(np.flatnonzero(permitted == antenna).tolist())
        free = []
        for channel in np.flatnonzero(c.real[antenna]).tolist():
            sat = int(occupant[antenna, channel])
            if sat in wanted:
                row[channel] = sat
                wanted.remove(sat)
            else:
                free.append(channel)
        for channel, sat in zip(free, sorted(wanted), strict=False):
            row[channel] = sat
    target[~c.real] = AUTO
    in_use = c.used_epoch >= max(c.used_epoch.max() - 1, 0)
    moved = in_use & (c.permitted >= 0) & (c.permitted != permitted)
    moving = (c.moving | moved) & (permitted >= 0)
    return _retargeted(replace(c, moving=moving), target, permitted)


def surrendered(c: Commander) -> Commander:
    """All receivers shall search by themselves again."""
    nowhere = np.full(SATELLITES, -1, np.int64)
    free = replace(c, moving=np.zeros(SATELLITES, bool))
    return _retargeted(free, np.full(c.real.shape, AUTO, np.int64), nowhere)


def _retargeted(c: Commander, target: NDArray[np.int64], permitted: NDArray[np.int64]) -> Commander:
    """A target dropped while its command was under way may have been reached: the channel is unknown."""
    overtaken = (c.transaction >= 0) & (target != c.asked)
    return replace(
        c, target=target, permitted=permitted, held=np.where(overtaken, UNKNOWN, c.held),
        transaction=np.where(overtaken, -1, c.transaction), stale=False,
    )  # fmt: skip


def due(c: Commander, epoch: int, options: Options) -> tuple[Commander, Commands]:
    """The commands of this epoch, releases first, and the state after sending them."""
    differs = (c.target != c.held) & (c.not_before <= epoch)
    new = differs & (c.transaction < 0)
    again = differs & (c.transaction >= 0) & (epoch - c.sent_epoch >= options.resend_epochs)
    antenna, channel = np.nonzero(new | again)
    if not len(antenna):
        return c, Commands(antenna, channel, antenna, antenna, antenna)
    order = np.lexsort((channel, antenna, c.target[antenna, channel] >= 0))
    at = antenna[order], channel[order]
    fresh_ones = new[at]
    transaction = c.transaction.copy()
    transaction[at[0][fresh_ones], at[1][fresh_ones]] = (
        c.next_transaction + np.arange(fresh_ones.sum())
    ) % TRANSACTIONS
    asked, sent = c.asked.copy(), c.sent_epoch.copy()
    asked[at], sent[at] = c.target[at], epoch
    sat = c.target[at]
    commands = Commands(
        *at,
        np.where(sat >= 0, TRACK, np.where(sat == IDLE, RELEASE, AUTONOMOUS)),
        np.maximum(sat, 0),
        transaction[at],
    )
    count = int(fresh_ones.sum())
    tally = replace(c.tally, sent=c.tally.sent + count, repeated=c.tally.repeated + len(sat) - count)
    return replace(
        c, asked=asked, transaction=transaction, sent_epoch=sent, tally=tally,
        next_transaction=(c.next_transaction + count) % TRANSACTIONS,
    ), commands  # fmt: skip


def signal_of(sat: NDArray[np.int64]) -> NDArray[np.int64]:
    """The signal a satellite is commanded on."""
    return np.where(sat // NUMBERS == GLONASS, NUMBER["L1OF"], NUMBER["L1CA"])


def used(c: Commander, sat: NDArray[np.int64], epoch: int) -> Commander:
    """After a fix with these satellites: handovers completed and their gaps counted."""
    when = c.used_epoch.copy()
    when[sat] = epoch
    done = sat[c.moving[sat]]
    if not len(done):
        return replace(c, used_epoch=when)
    gaps = epoch - c.used_epoch[done] - 1
    moving = c.moving.copy()
    moving[done] = False
    tally = replace(
        c.tally,
        handovers=c.tally.handovers + len(gaps),
        gap_epochs=c.tally.gap_epochs + int(gaps.sum()),
        gap_longest=max(c.tally.gap_longest, int(gaps.max())),
    )
    return replace(c, moving=moving, used_epoch=when, tally=tally)
