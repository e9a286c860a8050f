"""What a fault may wait for, seen in the frames of both directions before any fault has touched them.

first handover, third handover     the commands of an epoch take a satellite from one receiver and give it to
                                   another; a satellite that no receiver was commanded to track is none
first command, 5th command         commands of the flight software to a channel, not those sent again
first fix                          a NAV_STATUS that says there is one
G12 tracked, G12 tracked on aft    a receiver measures a satellite
RX1_RATE.cn0_dbhz < 30             a signal in physical units, of any frame of its message
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import KIND_BY_NAME, messages
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.emulator.faults.where import fields_of, satellite_of

COUNTED = ("handover", "command", "fix")
_TRACK = raw_of("Action")["TRACK"]
_ORDINALS = {"first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "sixth": 6, "seventh": 7,
             "eighth": 8, "ninth": 9, "tenth": 10}  # fmt: skip
_ORDINAL = re.compile(r"(\d+)(?:st|nd|rd|th)")
_SIGNAL = re.compile(r"(\w+)\.(\w+)\s*(<=|>=|<|>|==)\s*(-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)")
_TRACKED = re.compile(r"([A-Za-z]\d\d) tracked(?: on ([\w-]+))?")
_COMPARE: Mapping[str, Callable] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Counted:
    """The n-th of something that happens."""

    what: str
    number: int


@dataclass(frozen=True, slots=True)
class Tracks:
    """A receiver, by number, name or "" for any, measures a satellite."""

    satellite: str
    receiver: str


@dataclass(frozen=True, slots=True)
class Signalled:
    """A signal of a message compares with a value."""

    message: str
    signal: str
    comparison: str
    value: float


Meaning = Counted | Tracks | Signalled


def meaning(text: str) -> Meaning:
    """What a trigger's text means; ValueError if it means nothing."""
    if match := _SIGNAL.fullmatch(text):
        message, signal, comparison, value = match.groups()
        _check_signal(message, signal)
        return Signalled(message.upper(), signal, comparison, float(value))
    if match := _TRACKED.fullmatch(text):
        satellites.parse(match[1].upper())
        return Tracks(match[1].upper(), match[2] or "")
    which, _, what = text.partition(" ")
    numeral = _ORDINAL.fullmatch(which)
    number = int(numeral[1]) if numeral else _ORDINALS.get(which, 0)
    if number and what in COUNTED:
        return Counted(what, number)
    if number:
        raise ValueError(f"trigger '{text}': no event '{what}'; {did_you_mean(what, COUNTED)}")
    raise ValueError(
        f"trigger '{text}': not one of 'first handover', 'third command', 'first fix', 'G12 tracked on aft', "
        "'RX1_RATE.cn0_dbhz < 30'"
    )


def _check_signal(message: str, signal: str) -> None:
    known = {m.name: m.kind for m in messages(MAX_RECEIVERS)} | KIND_BY_NAME
    kind = known.get(message.upper())
    if kind is None:
        raise ValueError(f"no message '{message}'; {did_you_mean(message, known)}")
    names = [s.name for s in kind.signals]
    if signal not in names:
        raise ValueError(f"{message.upper()} has no signal '{signal}'; {did_you_mean(signal, names)}")


def _is_trigger(text: str) -> str:
    meaning(text)
    return text


Trigger = Annotated[str, AfterValidator(_is_trigger)]


@dataclass(frozen=True, slots=True)
class Commanded:
    """What the flight software has commanded, as the summary of a run counts it (docs/figures.md).

    held          satellite by (receiver, channel);  transaction   of the channel's last command
    """

    held: Mapping[tuple[int, int], int] = field(default_factory=dict)
    transaction: Mapping[tuple[int, int], int] = field(default_factory=dict)

    @property
    def receiver_of(self) -> dict[int, int]:
        """Receiver that is commanded to track a satellite."""
        return {sat: receiver for (receiver, _), sat in self.held.items()}

    def after(self, commands: Sequence[tuple[int, int, int, int, int]]) -> tuple[Commanded, int, int]:
        """With an epoch's commands (receiver, channel, action, satellite, transaction); how many are new, and
        how many handovers they are."""
        held, transaction, new = dict(self.held), dict(self.transaction), 0
        for receiver, channel, action, sat, number in commands:
            one = receiver, channel
            new += transaction.get(one) != number
            transaction[one] = number
            if action == _TRACK:
                held[one] = sat
            else:
                held.pop(one, None)
        then = Commanded(held, transaction)
        where = then.receiver_of
        handed = sum(where.get(sat, receiver) != receiver for sat, receiver in self.receiver_of.items())
        return then, new, handed


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What has happened up to now.

    counts       how often each of COUNTED has
    commanded    what each channel (receiver, channel) is commanded to track, and by which transaction last
    since        epoch in which each trigger came about, by its text
    answered     triggers that came about in what the flight software answered to the frames of the epoch
    """

    counts: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(COUNTED, 0))
    commanded: Commanded = Commanded()
    since: Mapping[str, int] = field(default_factory=dict)
    answered: frozenset[str] = frozenset()


class Watch:
    """Looks for triggers in the frames of a craft's bus; ValueError if a receiver is none of its antennas."""

    def __init__(self, codec: Codec, triggers: Sequence[str], names: Sequence[str]):
        self._codec, self._fields = codec, fields_of(codec)
        self._meanings = {text: meaning(text) for text in triggers}
        self._receivers = {
            m.receiver: _number_of(m.receiver, names)
            for m in self._meanings.values()
            if isinstance(m, Tracks) and m.receiver
        }
        self._identifiers = {
            m.message: _identifiers(m.message, codec)
            for m in self._meanings.values()
            if isinstance(m, Signalled)
        }

    def look(self, seen: Seen, frames: FrameBatch, epoch: int, *, answer: bool = False) -> Seen:
        """What has happened with the frames of an epoch, of one direction.

        answer   they are the flight software's to the epoch, whose own frames have left
        """
        if not self._meanings or not len(frames):
            return seen
        known = frames[frames.can_id <= SFF_MASK]
        measured = self._measured(known)
        commanded, commands, handovers = seen.commanded.after(self._commands(known))
        more = {"command": commands, "handover": handovers, "fix": self._fixes(known)}
        counts = {what: seen.counts[what] + more[what] for what in COUNTED}
        since, answered = dict(seen.since), seen.answered
        for text, what in self._meanings.items():
            if text not in since and self._came(what, counts, known, measured):
                since[text] = epoch
                answered |= {text} if answer else set()
        return Seen(counts, commanded, since, answered)

    def _commands(self, frames: FrameBatch) -> list[tuple[int, int, int, int, int]]:
        """Commands in order: receiver, channel, action, satellite, transaction."""
        layout = self._codec.kinds["COMMAND"]
        rows = frames[self._codec.kind_of[frames.can_id] == layout.number]
        action, channel, number = (
            layout.signal(name, rows.words) for name in ("action", "channel", "transaction")
        )
        sat = satellite_of(self._codec, self._fields, rows.can_id, rows.words)
        columns = (self._codec.number_of[rows.can_id], channel, action, sat, number)
        return list(zip(*(column.tolist() for column in columns), strict=True))

    def _fixes(self, frames: FrameBatch) -> int:
        layout = self._codec.kinds["NAV_STATUS"]
        rows = self._codec.kind_of[frames.can_id] == layout.number
        return int((layout.signal("mode", frames.words[rows]) != raw_of("NavMode")["NO_FIX"]).sum())

    def _measured(self, frames: FrameBatch) -> Bool:
        """(receivers + 1, SATELLITES) which receiver measures which satellite."""
        measured = np.zeros((MAX_RECEIVERS + 1, satellites.SATELLITES), bool)
        rows = frames[self._codec.kind_of[frames.can_id] == self._codec.kinds["SV_CLOCK"].number]
        sat = satellite_of(self._codec, self._fields, rows.can_id, rows.words)
        measured[self._codec.number_of[rows.can_id], sat] = True
        return measured

    def _came(self, what: Meaning, counts: Mapping[str, int], frames: FrameBatch, measured: Bool) -> bool:
        if isinstance(what, Counted):
            return counts[what.what] >= what.number
        if isinstance(what, Tracks):
            sat = satellites.parse(what.satellite)
            on = slice(1, None) if not what.receiver else self._receivers[what.receiver]
            return bool(np.any(measured[on, sat]))
        identifiers = self._identifiers[what.message]
        layout = self._codec.layouts[self._codec.kind_of[identifiers[0]]]
        values = layout.signal(what.signal, frames.words[np.isin(frames.can_id, identifiers)])
        return bool(_COMPARE[what.comparison](values, what.value).any())


def _identifiers(message: str, codec: Codec) -> list[int]:
    """Of a message, or of all of a kind; ValueError if this bus has none."""
    found = [m.can_id for m in messages(codec.receivers) if message in (m.name, m.kind.name)]
    if not found:
        raise ValueError(f"no message {message} on a bus of {codec.receivers} receivers")
    return found


def _number_of(receiver: str, names: Sequence[str]) -> int:
    known = {
        **{name: r for r, name in enumerate(names, 1)},
        **{f"rx{r}": r for r in range(1, len(names) + 1)},
    }
    if receiver not in known:
        raise ValueError(f"no receiver '{receiver}'; {did_you_mean(receiver, known)}")
    return known[receiver]
