"""When a fault acts: windows of time or epochs, periods, shares and numbers of frames, triggers.

As text, behind an @ and in words:

    @2m+30s           from 2 min after the run's first epoch on, for 30 s
    @120..180         from 120 s until before 180 s;  @90..  to the end;  @..60  from the beginning
    @#120..#180       the same in epochs;  @5  from 5 s on
    every=10s on=2s   within the window: every 10 s, for 2 s
    p=0.1             each frame with this probability
    n=3               three frames, then no more
    after first handover, when G12 tracked on aft, when RX1_RATE.cn0_dbhz < 30
                      the window counts from there (`gnss_hil.emulator.faults.triggers`)
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.faults.spoken import Spoken
from gnss_hil.emulator.faults.triggers import Trigger

_UNITS = {"ms": 1e-3, "s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0, "w": 604_800.0}
_PIECE = re.compile(r"(\d+(?:\.\d+)?)(ms|[smhdw])?")
_EPOCH = re.compile(r"#(\d+)")
_SHORT = {"p": "probability", "n": "count", "every": "every", "on": "on"}
"""Words of one-liners -> keys."""

LEADS = ("after", "when")
"""Words that open a trigger."""


def seconds(text: str) -> float:
    """A duration: "90", "2m", "1m30s", "250ms"; ValueError if it is none."""
    pieces = list(_PIECE.finditer(text))
    if not pieces or "".join(piece[0] for piece in pieces) != text:
        raise ValueError(f"'{text}' is no time; seconds, or numbers with ms, s, m, h, d or w: 90, 2m, 1m30s")
    return sum(float(number) * _UNITS[unit or "s"] for number, unit in (piece.groups() for piece in pieces))


def _instant(value: Any) -> Any:
    """Seconds as a number, epochs as "#N"."""
    if not isinstance(value, str):
        return value
    return value if _EPOCH.fullmatch(value) else seconds(value)


FARTHEST_S = 1e10
"""Three hundred years: beyond any run, and any clock."""
_TEXT = r"^(#\d+|(\d+(\.\d+)?(ms|[smhdw])?)+)$"
Instant = Annotated[
    Annotated[float, Field(ge=0, le=FARTHEST_S)] | Annotated[str, Field(pattern=r"^#\d+$")],
    BeforeValidator(_instant),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "minimum": 0, "maximum": FARTHEST_S},
                {"type": "string", "pattern": _TEXT},
            ]
        }
    ),
]
"""Seconds, text with units, or "#120": epochs."""


class When(Spoken):
    """The time of a fault; all of the run without one. Text, such as "@2m+30s", is read as well.

    start        seconds after the run's first epoch, or after the trigger; text with units; "#120": epochs
    stop         before this: seconds, or "#180"
    length       instead of stop: how long
    every        within the window: the time from one beginning to the next
    on           how long each time; one epoch without it
    probability  of each frame at the place
    count        frames at most, all told
    after        what has to happen first: "first handover", "third command", "first fix",
                 "G12 tracked on aft", "RX1_RATE.cn0_dbhz < 30"; the window counts from there
    """

    start: Instant = 0.0
    stop: Instant | None = None
    length: Instant | None = None
    every: Instant | None = None
    on: Instant | None = None
    probability: Annotated[float, Field(gt=0, le=1)] = 1.0
    count: Annotated[int, Field(ge=1, le=10**12)] | None = None
    after: Trigger | None = None

    @classmethod
    def _read(cls, text: str) -> dict[str, Any]:
        return parse(text.split())

    @model_validator(mode="after")
    def _is_a_time(self):
        if self.stop is not None and self.length is not None:
            raise ValueError("stop and length: one of the two")
        if self.on is not None and self.every is None:
            raise ValueError("on goes with every")
        for name in ("length", "every", "on"):
            given = getattr(self, name)
            if given is not None and not _number(given):
                raise ValueError(f"{name} {_said(given)} is no time; more than 0")
        if self.every is not None and self.on is not None and _comparable(self.every, self.on):
            check_period(self.every, self.on)
        if self.stop is not None and _comparable(self.stop, self.start):
            early, late = _number(self.start), _number(self.stop)
            if late <= early:
                raise ValueError(f"stop {self.stop} is not behind start {self.start}")
        return self


def _comparable(one: float | str, other: float | str) -> bool:
    """Whether both are seconds, or both epochs."""
    return isinstance(one, str) is isinstance(other, str)


def check_period(every: float | str, on: float | str) -> None:
    """ValueError if what comes again and again is longer than the time from one beginning to the next."""
    if _number(on) > _number(every):
        raise ValueError(f"on {_said(on)} is longer than every {_said(every)}")


def _number(value: float | str) -> float:
    return float(value.removeprefix("#")) if isinstance(value, str) else value


def parse(words: Sequence[str]) -> dict[str, Any]:
    """Keys of a `When` from words; ValueError names all that are none, and all that are there twice, a line
    each."""
    found: dict[str, Any] = {}
    spoken: dict[str, str] = {}
    wrong: list[str] = []
    for word, sort in _phrases(words):
        if sort in spoken:
            wrong.append(f"'{spoken[sort]}' and '{word}': one of them")
            continue
        spoken[sort] = word
        try:
            found |= _keys(word, sort)
        except ValueError as error:
            wrong.append(str(error))
    if wrong:
        raise ValueError("\n".join(wrong))
    return found


def _phrases(words: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Words, those of a trigger together, and their sorts: "@", "after", the key of others."""
    words = list(words)
    while words:
        word = words.pop(0)
        if word in LEADS:
            while words and not is_word(words[0]):
                word += " " + words.pop(0)
            yield word, "after"
        elif is_word(word):
            yield word, "@" if word.startswith("@") else word.partition("=")[0]
        else:
            yield word, word


def _keys(word: str, sort: str) -> dict[str, Any]:
    """Keys of a `When` from a phrase."""
    if sort == "@":
        return _window(word[1:])
    if sort == "after":
        return {"after": word.partition(" ")[2]}
    if sort in _SHORT:
        return {_SHORT[sort]: _figure(sort, word.partition("=")[2])}
    raise ValueError(f"'{word}' is no time; @2m+30s, @120..180, every=10s, p=0.1, n=3, after TRIGGER")


def is_word(word: str) -> bool:
    """Whether a word of a one-liner is of the time."""
    return word.startswith("@") or word in LEADS or (word.partition("=")[0] in _SHORT and "=" in word)


def _window(text: str) -> dict[str, Any]:
    start, dots, stop = text.partition("..")
    if dots:
        return {key: _instant(value) for key, value in (("start", start), ("stop", stop)) if value}
    start, plus, length = text.partition("+")
    return {"start": _instant(start), **({"length": _instant(length)} if plus else {})}


def _figure(key: str, value: str) -> Any:
    """A value of p=, n=, every=, on=."""
    try:
        return {"p": float, "n": int}.get(key, _instant)(value)
    except ValueError:
        raise ValueError(f"{key}={value}: not a {'whole number' if key == 'n' else 'number'}") from None


def text(when: When) -> str:
    """A time in words that `parse` reads; "" for all of the run."""
    words = [] if when.after is None else [f"after {when.after}"]
    if when.length is not None:
        words.append(f"@{_said(when.start)}+{_said(when.length)}")
    elif when.stop is not None:
        words.append(f"@{_said(when.start)}..{_said(when.stop)}")
    elif when.start:
        words.append(f"@{_said(when.start)}")
    words += [f"{key}={_said(value)}" for key in ("every", "on") if (value := getattr(when, key)) is not None]
    words += [f"p={when.probability:.12g}"] if when.probability < 1 else []
    words += [f"n={when.count}"] if when.count is not None else []
    return " ".join(words)


def _said(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.12g}"


@dataclass(frozen=True, slots=True)
class Window:
    """A time in epochs of a run.

    start, stop   first epoch and the one behind the last; None: to the end. With a trigger from there
    every, on     period and its part that counts; 0: no period
    """

    start: int
    stop: int | None
    every: int
    on: int
    probability: float
    count: int | None
    after: Trigger | None

    def begun(self, epoch: int, origin: int) -> int | None:
        """First epoch of the window, or of the part of it, that an epoch is in; None if it is in none.

        origin   of the trigger, 0 without one
        """
        since = epoch - origin
        if since < self.start or (self.stop is not None and since >= self.stop):
            return None
        if not self.every:
            return origin + self.start
        turn, within = divmod(since - self.start, self.every)
        return origin + self.start + turn * self.every if within < self.on else None


def window(when: When, interval_ns: int) -> Window:
    """In epochs; an epoch belongs to the window if its mark does."""

    def epochs(value: float | str) -> int:
        """The first epoch not before an instant."""
        if isinstance(value, str):
            return int(value[1:])
        return -(-round(value * NS_PER_S) // interval_ns)

    start = epochs(when.start)
    stop = None if when.stop is None else max(epochs(when.stop), start + 1)
    if when.length is not None:
        stop = start + max(epochs(when.length), 1)
    every = 0 if when.every is None else epochs(when.every)
    on = 1 if when.on is None else max(epochs(when.on), 1)
    if every and on > every:
        raise ValueError(f"at: on {when.on} is longer than every {when.every}")
    return Window(start, stop, every, on, when.probability, when.count, when.after)
