"""Channel commands: what a receiver obeys, what it refuses, and why.

All commands of an epoch are weighed together. RELEASEs go before TRACKs and AUTONOMOUS, each group in
order of arrival; a TRACK replaces whatever its channel had. What counts is where a channel ends up: if on
the satellite it was on, it keeps its lock, so commands can be repeated without harm. A command goes before
a channel that searches by itself: such a channel gives up a satellite commanded elsewhere in its receiver.

This is where arrow 9 -> 1 of RU 2706636 C1 ends: a tracking permission reaches an antenna's channels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import satellites, systems
from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.emulator.receivers.emulated.channels import NOTHING, Channels, retarget
from gnss_hil.emulator.signal.carriers import Carriers

ACTION = {label: raw for raw, label in VALUES["Action"].items()}
RESULT = {label: raw for raw, label in VALUES["AckResult"].items()}
ACCEPTED = RESULT["ACCEPTED"]

_HIGHEST_NUMBER = systems.column(lambda system: system.numbers, 0)
"""(8,) satellites that each system has room for."""

OLDEST_EPOCHS = 3
"""A command answers an epoch and comes while the next one is awaited: 1 epoch old when it is weighed. Where
the emulator does not wait for the flight software it may be later; older than this it was held back, and is
not obeyed."""


@dataclass(frozen=True, slots=True, eq=False)
class Commands:
    """Commands of one epoch (c,), in order of arrival; `receiver` is 1-based, `sat` a satellite index."""

    receiver: I64
    channel: I64
    action: I64
    sat: I64
    signal: I64
    transaction: I64

    def __len__(self) -> int:
        return len(self.receiver)


@dataclass(frozen=True, slots=True, eq=False)
class Prospects:
    """What a receiver holds of the sky when it weighs a command.

    row_of      (SATELLITES,) row of the sky by satellite index, -1 none
    available, healthy, in_sight   (n,) by row; in_sight is True where the receiver cannot judge
    carriers    signals that the receivers can track
    """

    row_of: I64
    available: Bool
    healthy: Bool
    in_sight: Bool
    carriers: Carriers

    def column(self, commands: Commands) -> I64:
        """(c,) column of the satellite and signal that each command names, of those that there are."""
        return self.carriers.rank_of[commands.signal] * len(self.available) + self.row_of[commands.sat]


def timely(frames: FrameBatch, epoch: int) -> Bool:
    """(c,) whether commands received before `epoch` is played answer one of the OLDEST_EPOCHS before it.

    They carry the number of the epoch they answer modulo 16, so one held back for 16 epochs is young again:
    that is left to the counter of its stream.
    """
    age = (epoch - (frames.data[:, 1] >> 4).astype(np.int64)) % 16
    return (age >= 1) & (age <= OLDEST_EPOCHS)


def read(codec: Codec, frames: FrameBatch) -> Commands:
    """Commands from screened frames of the kind COMMAND."""
    fields = codec.decode("COMMAND", frames.data)
    return Commands(
        codec.number_of[frames.can_id].astype(np.int64),
        fields["channel"],
        fields["action"],
        satellites.index(fields["sat_system"], fields["sat_number"]),
        fields["signal"],
        fields["transaction"],
    )


def _refusals(commands: Commands, counts: I64, prospects: Prospects) -> I64:
    """(c,) result as far as it is clear without the other channels; the first row that applies."""
    system, number = satellites.system_of(commands.sat), satellites.number_of(commands.sat)
    row = prospects.row_of[commands.sat]
    track = commands.action == ACTION["TRACK"]
    table: tuple[tuple[str, Bool], ...] = (
        ("NO_SUCH_CHANNEL", commands.channel >= counts[commands.receiver - 1]),
        ("BAD_ACTION", ~np.isin(commands.action, list(ACTION.values()))),
        ("ACCEPTED", ~track),
        ("NO_SUCH_SATELLITE", ((number == 0) | (number > _HIGHEST_NUMBER[system])) & (row < 0)),
        ("NO_SUCH_SIGNAL", ~prospects.carriers.tracks(commands.signal, commands.receiver - 1, commands.sat)),
        ("NOT_IN_ALMANAC", (row < 0) | ~prospects.available[row]),
        ("UNHEALTHY", ~prospects.healthy[row]),
        ("BEHIND_EARTH", ~prospects.in_sight[row]),
    )
    return np.select([hit for _, hit in table], [RESULT[name] for name, _ in table], ACCEPTED)


def obey(
    channels: Channels, commands: Commands, counts: I64, prospects: Prospects, t_ns: int
) -> tuple[Channels, I64]:
    """Channels after the commands, and the result (c,) of each: permission 9 -> 1 of RU 2706636 C1.

    counts  (m,) channels of each receiver
    """
    result = _refusals(commands, counts, prospects)
    commanded, target = channels.commanded.copy(), channels.target.copy()
    column = prospects.column(commands)
    release_first = np.argsort(commands.action != ACTION["RELEASE"], kind="stable")
    for i in release_first[result[release_first] == ACCEPTED].tolist():
        mine = commanded[commands.receiver[i] - 1], target[commands.receiver[i] - 1]
        result[i] = _ACT[int(commands.action[i])](*mine, int(commands.channel[i]), int(column[i]))
    return retarget(channels, commanded, target, t_ns), result


# What an action does to one receiver's `commanded` and `target` (k,), in place, and its result.


def _release(commanded: Bool, target: I64, channel: int, column: int) -> int:
    commanded[channel], target[channel] = True, NOTHING
    return ACCEPTED


def _autonomous(commanded: Bool, target: I64, channel: int, column: int) -> int:
    commanded[channel] = False
    return ACCEPTED


def _track(commanded: Bool, target: I64, channel: int, column: int) -> int:
    elsewhere = target == column
    elsewhere[channel] = False
    if (elsewhere & commanded).any():
        return RESULT["ALREADY_TRACKED_HERE"]
    target[elsewhere] = NOTHING
    commanded[channel], target[channel] = True, column
    return ACCEPTED


_ACT = {ACTION["RELEASE"]: _release, ACTION["TRACK"]: _track, ACTION["AUTONOMOUS"]: _autonomous}
