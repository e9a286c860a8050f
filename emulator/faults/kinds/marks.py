"""Time marks that are missing, late or wrong, and a second master of time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import U64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.emulator.faults import traffic
from gnss_hil.emulator.faults.alter import Alter
from gnss_hil.emulator.faults.base import Actions, Direction, Fits, Now, Rows, Sleeper
from gnss_hil.emulator.faults.kinds.row import Bus, Row
from gnss_hil.emulator.faults.models import Altering, Fault
from gnss_hil.emulator.faults.place import Place
from gnss_hil.emulator.faults.signals import physical, with_signal, with_words
from gnss_hil.emulator.faults.when import FARTHEST_S, seconds
from gnss_hil.emulator.faults.where import Where

MARK = ("TIME_MARK", "TIME_GPS", "TIME_FINE")
_WEEKS = 1 << 16


def _span(value: Any) -> Any:
    """Seconds of a text with a sign."""
    if not isinstance(value, str):
        return value
    sign = -1.0 if value.startswith("-") else 1.0
    return sign * seconds(value.lstrip("+-"))


_TEXT = r"^[+-]?(\d+(\.\d+)?(ms|[smhdw])?)+$"
Span = Annotated[
    float,
    Field(ge=-FARTHEST_S, le=FARTHEST_S),
    BeforeValidator(_span),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "minimum": -FARTHEST_S, "maximum": FARTHEST_S},
                {"type": "string", "pattern": _TEXT},
            ]
        }
    ),
]
"""Seconds, or text with a sign and units: "-1s", "1024w"."""


class MarkMissing(Fault):
    """Time marks do not come: all three frames, or those at the place."""

    kind: Literal["mark-missing"]
    on: Place = Place(message=MARK)


class MarkLate(Fault):
    """Time marks come behind the frames that they open: at the end of the block, or epochs later.

    epochs   by so many; 0: at the end of their own block
    """

    kind: Literal["mark-late"]
    epochs: Annotated[int, Field(ge=0, le=100_000)] = 0
    on: Place = Place(message=MARK)


class MarkJump(Altering):
    """Time marks that show another time, under a valid CRC; the number of the epoch stays.

    by_s        seconds, or text with a sign: "10ms", "-1s", "20m", "1w", "1024w" (a rollover of the week)
    leap_s      added to the leap seconds
    """

    kind: Literal["mark-jump"]
    by_s: Span = 0.0
    leap_s: Annotated[int, Field(ge=-100, le=100)] = 0
    on: Place = Place(message=("TIME_GPS", "TIME_FINE"))

    @model_validator(mode="after")
    def _jumps(self):
        if not (self.by_s or self.leap_s):
            raise ValueError("jumps by nothing; give by_s or leap_s")
        return self


class SecondTimeMaster(Fault):
    """Another node sends time marks of its own behind the true ones, with counters of its own.

    by_s            its time is ahead by
    epochs_ahead    its epochs are
    session         of it; the run's without one
    """

    kind: Literal["second-time-master"]
    by_s: Span = 1.0
    epochs_ahead: Annotated[int, Field(ge=-65_535, le=65_535)] = 0
    session: Annotated[int, Field(ge=0, le=65_535)] | None = None
    on: Place = Place(message=MARK)


@dataclass(frozen=True, slots=True, eq=False)
class Shown(Fits):
    """Content: marks that show a time ahead by some nanoseconds, and other leap seconds.

    Both frames of a mark are needed to tell its time; a block without them has none that is changed.
    """

    codec: Codec
    by_ns: int
    leap_s: int

    def fresh(self, codec: Codec) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, hit: Bool, now: Now) -> tuple[None, U64]:
        return None, ahead(self.codec, frames, hit, self.by_ns, self.leap_s)


def ahead(codec: Codec, frames: FrameBatch, hit: Bool, by_ns: int, leap_s: int) -> U64:
    """Payloads of an epoch's frames (n,) with the time of marks that are hit moved; the week wraps as its
    signal does."""
    words = frames.words.copy()
    gps, fine = (codec.kinds[name] for name in ("TIME_GPS", "TIME_FINE"))
    weeks = np.flatnonzero(hit & (frames.can_id == codec.can_id_of["TIME_GPS", 0]))
    fines = np.flatnonzero(hit & (frames.can_id == codec.can_id_of["TIME_FINE", 0]))
    for week_row, fine_row in zip(weeks.tolist(), fines.tolist(), strict=False):
        one, other = words[[week_row]], words[[fine_row]]
        week, second = (int(physical(gps, name, one)[0]) for name in ("week", "second"))
        nanosecond = int(physical(fine, "nanosecond", other)[0])
        t_ns = (gpstime.from_week(week, second, nanosecond) + by_ns) % (_WEEKS * NS_PER_WEEK)
        for name, value in zip(("week", "second"), gpstime.week_second_ns(t_ns), strict=False):
            one = with_signal(gps, name, one, np.array([value]))
        other = with_signal(fine, "nanosecond", other, np.array([t_ns % NS_PER_S]))
        if leap_s:
            other = with_signal(fine, "leap", other, physical(fine, "leap", other) + leap_s)
        words[[week_row]], words[[fine_row]] = one, other
    return words


@dataclass(frozen=True, slots=True, eq=False)
class ToTheEnd(Sleeper):
    """An action: frames come at the end of their block."""

    def fresh(self) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, rows: Rows, now: Now) -> tuple[None, FrameBatch, int]:
        if not rows.hit.any():
            return None, frames, 0
        return None, concat((frames[~rows.hit], frames[rows.hit])), int(rows.hit.sum())


@dataclass(frozen=True, slots=True, eq=False)
class AnotherMaster(Sleeper):
    """An action: the marks once more, of another time, epoch and session, by a sender that counts its own."""

    codec: Codec
    by_ns: int
    epochs: int
    session: int | None

    def fresh(self) -> int:
        return 0

    def step(self, sent: int, frames: FrameBatch, rows: Rows, now: Now) -> tuple[int, FrameBatch, int]:
        if not rows.hit.any():
            return sent, frames, 0
        own = frames[rows.hit]
        words = ahead(self.codec, own, np.ones(len(own), bool), self.by_ns, 0)
        layout = self.codec.kinds["TIME_MARK"]
        marks = own.can_id == self.codec.can_id_of["TIME_MARK", 0]
        epoch = physical(layout, "epoch", words[marks]) + self.epochs
        words[marks] = with_signal(layout, "epoch", words[marks], epoch)
        if self.session is not None:
            words[marks] = with_signal(
                layout, "session", words[marks], np.full(int(marks.sum()), self.session)
            )
        added = traffic.sealed(with_words(own, words), 1, sent, now)
        at = int(np.flatnonzero(rows.hit)[-1]) + 1
        return sent + 1, concat((frames[:at], added, frames[at:])), len(added)


def _late(p: MarkLate, bus: Bus, where: Where) -> Actions:
    return {Direction.FLIGHT: traffic.Delay(p.epochs, drawn=False) if p.epochs else ToTheEnd()}


def _jump(p: MarkJump, bus: Bus, where: Where) -> Actions:
    if where.identifiers.sum() < 2:
        raise ValueError("on: a mark's time is in TIME_GPS and TIME_FINE together; name both")
    shown = Shown(bus.codec, round(p.by_s * NS_PER_S), p.leap_s)
    return {Direction.FLIGHT: Alter(bus.codec, shown, p.protection)}


def _second(p: SecondTimeMaster, bus: Bus, where: Where) -> Actions:
    return {Direction.FLIGHT: AnotherMaster(bus.codec, round(p.by_s * NS_PER_S), p.epochs_ahead, p.session)}


def _marks(p: Fault) -> tuple[str, ...]:
    return MARK


ROWS = (
    Row("mark-missing", MarkMissing, "time marks do not come",
        lambda p, bus, where: {Direction.FLIGHT: traffic.Drop()}, "mark-missing @30+5", touches=_marks),
    Row("mark-late", MarkLate, "time marks come behind the frames they open, or epochs later", _late,
        "mark-late @30+5", first="epochs", touches=_marks),
    Row("mark-jump", MarkJump, "time marks show another time: 10 ms to 1,024 weeks, a leap second", _jump,
        "mark-jump 1s @30+5", first="by_s",
        touches=lambda p: ("TIME_GPS", "TIME_FINE")),
    Row("second-time-master", SecondTimeMaster, "another node sends time marks too", _second,
        "second-time-master 1s @30+5", first="by_s", touches=_marks),
)  # fmt: skip
