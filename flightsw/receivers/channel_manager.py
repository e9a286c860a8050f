"""Arrow 9->1 of RU 2706636 C1: tracking permissions as channel commands, repeated until acknowledged.

A channel has a *target* (what it shall do) and is *held* at what was last acknowledged; a command is due
while the two differ. Both are a track (a satellite by one of its signals), IDLE or AUTO (searching by
itself); what is held may also be UNKNOWN. The rules:

- A satellite that is to be tracked by two signals has two channels of its antenna: one permission, one
  handover, two commands. Where the second signal is refused it goes on by its first alone, and is tried again
  after `backoff_epochs`, or, where the receiver has no such signal of it, `second_signal_backoff_epochs`.
- A satellite stays on the channels it is on. A channel not needed is released: its receiver stops searching.
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
of the patent is about. So the gap stands, once in a flight; the position is propagated meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.dbc.contract.messages import values_of
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.measurement.signals import satellite_of, signal_of, track_of
from gnss_hil.flightsw.receivers import channel_table, satellite_table
from gnss_hil.flightsw.receivers.channel_table import AUTO, IDLE, ChannelTable
from gnss_hil.flightsw.receivers.options import ChannelOptions
from gnss_hil.flightsw.receivers.satellite_table import SatelliteTable
from gnss_hil.flightsw.records.commands import Commands
from gnss_hil.flightsw.records.epoch import Acks, Measurements

_ACTION, _RESULT = raw_of("Action"), raw_of("AckResult")
RELEASE, TRACK, AUTONOMOUS = _ACTION["RELEASE"], _ACTION["TRACK"], _ACTION["AUTONOMOUS"]
ACCEPTED = _RESULT["ACCEPTED"]
CHANNEL_REFUSALS = (_RESULT["NO_SUCH_CHANNEL"], _RESULT["NO_SUCH_SIGNAL"], _RESULT["BAD_ACTION"])
"""The channel's fault; all others are the satellite's. Of a second signal NO_SUCH_SIGNAL is the satellite's
too: many do not send it."""
NO_SECOND_SIGNAL = (_RESULT["NO_SUCH_SIGNAL"], _RESULT["ALREADY_TRACKED_HERE"])
"""Answers to a second signal that will not change soon; the latter is that of a receiver that does not tell
signals apart."""
TRANSACTIONS, RESULTS = values_of("COMMAND", "transaction"), values_of("ACK", "result")
_NONE = np.zeros(0, np.int64)
NO_SECOND = np.zeros(SATELLITES, np.int64)
"""Every satellite by its first signal alone."""
NO_COMMANDS = Commands(_NONE, _NONE, _NONE, _NONE, _NONE, _NONE)


@dataclass(frozen=True, slots=True)
class CommandStatistics:
    """sent: commands without repeats; refused (RESULTS,) by AckResult; gap_epochs: epochs between a
    satellite's last use on one antenna and its first on the next, over all handovers, and the longest."""

    sent: int
    repeated: int
    accepted: int
    refused: I64
    handovers: int
    gap_epochs: int
    gap_longest: int


@dataclass(frozen=True, slots=True)
class ChannelManager:
    """All that the channel manager keeps from epoch to epoch.

    stale   the targets have to be planned anew even if the permissions stay the same
    boots   (MAX_RECEIVERS,) last boot counts received, -1 none
    """

    channels: ChannelTable
    satellites: SatelliteTable
    stale: bool
    next_transaction: int
    boots: I64
    statistics: CommandStatistics

    @property
    def commanded(self) -> bool:
        """Whether any channel acknowledged a command: from here on only acknowledged channels are used."""
        return self.channels.commanded


def autonomous(channels: I64, receivers: int) -> ChannelManager:
    """Every channel searches by itself; channels (m,) of each antenna."""
    return ChannelManager(
        channels=channel_table.searching(channels),
        satellites=satellite_table.untouched(),
        stale=True,
        next_transaction=0,
        boots=np.full(receivers, -1, np.int64),
        statistics=CommandStatistics(0, 0, 0, np.zeros(RESULTS, np.int64), 0, 0, 0),
    )


def acknowledged(manager: ChannelManager, acks: Acks, epoch: int, options: ChannelOptions) -> ChannelManager:
    """After this epoch's answers; those that answer no command under way, as it was sent,
    have no effect."""
    if not len(acks):
        return manager
    channels, satellites = manager.channels, manager.satellites
    rows, inside = channels.rows(acks.receiver, acks.channel)
    asked = channels.asked[rows]
    ours = (asked < 0) | (satellite_of(np.maximum(asked, 0)) == acks.sat)  # else the command was altered
    current = inside & (channels.transaction[rows] == acks.transaction) & ours
    rows, acks = rows[current], acks[current]
    accepted = acks.result == ACCEPTED
    of_second = channels.asked[rows] >= SATELLITES
    channels = channels.answered(rows, accepted)
    if not accepted.all():
        single = (
            of_second & ~accepted & ~np.isin(acks.result, (_RESULT["NO_SUCH_CHANNEL"], _RESULT["BAD_ACTION"]))
        )
        by_channel = np.isin(acks.result, CHANNEL_REFUSALS) & ~single
        until = epoch + options.backoff_epochs
        channels = channels.waiting_until(rows[by_channel], until)
        satellites = satellites.refused(acks.sat[~accepted & ~by_channel & ~single], until)
        if single.any():
            lasts = np.isin(acks.result[single], NO_SECOND_SIGNAL)
            wait = np.where(lasts, options.second_signal_backoff_epochs, options.backoff_epochs)
            satellites = satellites.without_second(acks.sat[single], epoch + wait)
    statistics = replace(
        manager.statistics,
        accepted=manager.statistics.accepted + int(accepted.sum()),
        refused=manager.statistics.refused + np.bincount(acks.result[~accepted], minlength=RESULTS),
    )
    stale = manager.stale or not accepted.all()
    return replace(manager, channels=channels, satellites=satellites, stale=stale, statistics=statistics)


def restarted(manager: ChannelManager, boots: I64) -> Bool:
    """(MAX_RECEIVERS,) receivers whose boot count is another than the last one that was heard."""
    return (boots >= 0) & (manager.boots >= 0) & (boots != manager.boots)


def contradicted(manager: ChannelManager, m: Measurements, boots: I64) -> ChannelManager:
    """After comparing acknowledgements with what is measured, and boot counts with those before."""
    channels = manager.channels
    rows, inside = channels.rows(m.receiver, m.channel)
    wrong = inside & channels.contradicts(rows, channels.measured(m.sat, m.signal))
    same_boots = _same(boots, manager.boots)
    if same_boots and not wrong.any():
        return manager
    anew = restarted(manager, boots)
    latest = np.where(boots >= 0, boots, manager.boots)
    if not wrong.any() and not anew.any():
        return replace(manager, boots=latest)
    unknown = channels.of_antennas(anew[: len(channels.exists) // channels.width])
    unknown[rows[wrong]] = True
    return replace(manager, channels=channels.forgotten(unknown), stale=True, boots=latest)


def _same(a: I64, b: I64) -> bool:
    """Whether arrays of one shape are equal."""
    return a is b or a.tobytes() == b.tobytes()


def usable(manager: ChannelManager, m: Measurements) -> Bool:
    """(n,) measurements that may enter the fix: of what channels shall track and acknowledged, and of
    channels that were commanded for the first time and have not answered yet. After a restart the receivers
    refuse the first commands of streams whose counters happen to repeat."""
    rows, inside = manager.channels.rows(m.receiver, m.channel)
    if not manager.commanded:
        return inside
    return inside & manager.channels.usable(rows, manager.channels.measured(m.sat, m.signal))


def planned(
    manager: ChannelManager, permitted: I64, m: Measurements, second: I64 = NO_SECOND
) -> ChannelManager:
    """With targets that realise the permissions (SATELLITES,): antenna of each satellite, -1 none, and the
    signal it is tracked by there beside its first, 0 none."""
    before = manager.satellites
    if not manager.stale and _same(permitted, before.permitted) and _same(second, before.second):
        return manager
    channels = manager.channels
    measured = np.full(len(channels.exists), -1, np.int64)
    rows, inside = channels.rows(m.receiver, m.channel)
    measured[rows[inside]] = track_of(m.sat[inside], m.signal[inside])
    target = channel_table.assigned(channels, permitted, second, measured)
    satellites = before.permitted_on(permitted, second)
    return replace(manager, channels=channels.retargeted(target), satellites=satellites, stale=False)


def surrendered(manager: ChannelManager) -> ChannelManager:
    """All receivers shall search by themselves again."""
    auto = np.full(len(manager.channels.exists), AUTO, np.int64)
    channels, satellites = manager.channels.retargeted(auto), manager.satellites.released()
    return replace(manager, channels=channels, satellites=satellites, stale=False)


def due(manager: ChannelManager, epoch: int, options: ChannelOptions) -> tuple[ChannelManager, Commands]:
    """The commands of this epoch, releases first, and the state after sending them."""
    channels = manager.channels
    rows, anew = channels.due(epoch, options.resend_epochs)
    if not len(rows):
        return manager, NO_COMMANDS
    track = channels.target[rows]
    order = np.argsort(track >= 0, kind="stable")
    rows, track, first = rows[order], track[order], anew[order]
    count = int(first.sum())
    transaction = channels.transaction[rows]
    transaction[first] = (manager.next_transaction + np.arange(count)) % TRANSACTIONS
    commands = Commands(
        antenna=rows // channels.width,
        channel=rows % channels.width,
        action=np.where(track >= 0, TRACK, np.where(track == IDLE, RELEASE, AUTONOMOUS)),
        sat=satellite_of(np.maximum(track, 0)),
        signal=signal_of(np.maximum(track, 0)),
        transaction=transaction,
    )
    statistics = replace(
        manager.statistics,
        sent=manager.statistics.sent + count,
        repeated=manager.statistics.repeated + len(rows) - count,
    )
    return replace(
        manager,
        channels=channels.sent(rows, transaction, epoch),
        next_transaction=(manager.next_transaction + count) % TRANSACTIONS,
        statistics=statistics,
    ), commands


def used(manager: ChannelManager, sat: I64, epoch: int) -> ChannelManager:
    """After a fix with satellites (n,): handovers completed and their gaps counted."""
    satellites, gaps = manager.satellites.in_fix(sat, epoch)
    if not len(gaps):
        return replace(manager, satellites=satellites)
    before = manager.statistics
    statistics = replace(
        before,
        handovers=before.handovers + len(gaps),
        gap_epochs=before.gap_epochs + int(gaps.sum()),
        gap_longest=max(before.gap_longest, int(gaps.max())),
    )
    return replace(manager, satellites=satellites, statistics=statistics)
