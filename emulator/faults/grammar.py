"""Faults in one line: PLACE KIND [VALUE [UNIT]] [KEY=VALUE ...] [TIME].

    rx2 off @2m+30s
    G12 range +30 m @120..180
    att freeze @1m+10s
    frames 0x100&0x7F0 drop p=0.1
    rx1 ch0 RANGE.pseudorange_m += 30 @30+10
    mark-jump 1024w @5 name=rollover detected_by=mark within_epochs=1

Words in front of the kind are the place (`gnss_hil.emulator.faults.place`), those of time stand anywhere
behind it (`gnss_hil.emulator.faults.when`). A value behind the kind is that of its first parameter, which the
unit has to fit. A change of a signal needs no kind: it is a masquerade. Every line is the table of a fault
file in other words, and back.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, cast

from gnss_hil.dbc.common.near import did_you_mean, nearest
from gnss_hil.emulator.faults import place as places
from gnss_hil.emulator.faults import signals, when
from gnss_hil.emulator.faults.kinds.content import Masquerade
from gnss_hil.emulator.faults.kinds.registry import KINDS, WORDS, called
from gnss_hil.emulator.faults.kinds.row import Row
from gnss_hil.emulator.faults.models import Altering, Expect, Fault
from gnss_hil.emulator.faults.protect import Protection

NOISE = ("frames", "frame", "the")
"""Words that say nothing and may be there."""

_JOINED = re.compile(r"\s*(?<![<>=])([+\-*]?=)(?!=)\s*")
_CHANGE = re.compile(r"\w+\.\w+(?:[+\-*]?=.+)?")
_UNITS = {"m": "m", "m/s": "mps", "ns": "ns", "ns/s": "ns_per_s", "s": "s"}
"""Units of one-liners -> end of a parameter's name."""

_EXPECTED = tuple(Expect.model_fields)
_COMMON = ("name", "craft")
_HEADER = {"crc": "crc", "counter": "counter", "crc_by": "crc_by", "counter_by": "counter_by",
           "epoch": "epoch"}  # fmt: skip
"""Keys of one-liners -> keys of the protection, of kinds that have one."""


def parse(text: str) -> dict[str, Any]:
    """The table of a fault file that a line stands for; ValueError with a line for each mistake if it stands
    for none."""
    document, wrong = read(text)
    if wrong:
        raise ValueError("\n".join([*wrong, *of_place_and_time(document)]))
    return document


def read(text: str) -> tuple[dict[str, Any], list[str]]:
    """The table that a line stands for as far as it does, and its mistakes: a line each, but for those of
    place, time and values."""
    words = _joined(text).split()
    if not words:
        return {}, ["no fault: PLACE KIND [VALUE] [@TIME], as in rx2 off @2m+30s"]
    time, rest = _time_apart(words)
    pairs = [word for word in rest if _is_pair(word)]
    plain = [word for word in rest if not _is_pair(word) and word.lower() not in NOISE]
    found = _kind_of(plain)
    if found is None:
        place, said = _no_kind(plain)
        document, wrong = {}, [said]
    else:
        place, row, behind = found
        document, wrong = _content(row, behind)
        more, wrong_too = _pairs(pairs, row)
        wrong += [
            *wrong_too,
            *(f"{row.name}: {key} twice" for key in document if key in more and key != "kind"),
        ]
        document |= more
    for key, words in (("on", place), ("at", time)):
        if words:
            document[key] = " ".join(words)
    return document, wrong


def of_place_and_time(document: Mapping[str, Any]) -> list[str]:
    """Mistakes of a line's place and time."""
    wrong: list[str] = []
    for key, read_words in (("on", places.parse), ("at", when.parse)):
        try:
            read_words(document.get(key, "").split())
        except ValueError as error:
            wrong += [f"{key}: {line}" for line in str(error).splitlines()]
    return wrong


def _joined(text: str) -> str:
    """With no blanks around = and behind @, but in what is compared."""
    head, lead, tail = _split_at_trigger(text)
    joined = _JOINED.sub(r"\1", head)
    return re.sub(r"@\s+", "@", joined) + lead + tail


def _split_at_trigger(text: str) -> tuple[str, str, str]:
    match = re.search(r"\s(after|when)\s", text)
    return (text, "", "") if match is None else (text[: match.start()], match[0], text[match.end() :])


def is_spoken(word: str) -> bool:
    """Whether a word is of a one-liner, and not the name of a file."""
    return (
        word in WORDS
        or when.is_word(word)
        or _is_pair(word)
        or bool(_PLACES.fullmatch(word))
        or (_is_surely_a_place(word))
    )


def _is_pair(word: str) -> bool:
    key, equals, _ = word.partition("=")
    return bool(equals) and key.isidentifier()


def _time_apart(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Words of the time, and the others; a trigger goes to the next word of time or key."""
    time: list[str] = []
    rest: list[str] = []
    inside = False
    for word in words:
        if when.is_word(word):
            inside = word in when.LEADS
            time.append(word)
        elif inside and not _is_pair(word):
            time.append(word)
        else:
            inside = False
            rest.append(word)
    return time, rest


def _kind_of(words: Sequence[str]) -> tuple[list[str], Row, list[str]] | None:
    """Words of the place, the kind, and words behind it; None if none names one."""
    for at, word in enumerate(words):
        if _CHANGE.fullmatch(word):
            before = [one for one in words[:at] if one != "masquerade"]
            return before, KINDS["masquerade"], list(words[at:])
        if word == "masquerade" and at + 1 < len(words) and _CHANGE.fullmatch(words[at + 1]):
            continue
        if word in WORDS:
            place = list(words[:at])
            row = called(word, _place_keys(place))
            assert row is not None, "a word of a kind"
            return place, row, list(words[at + 1 :])
    return None


def _place_keys(words: Sequence[str]) -> Mapping[str, Any]:
    """Keys of a place, of those words that are one."""
    found: dict[str, Any] = {}
    for word in words:
        with suppress(ValueError):
            found |= places.parse([word])
    return found


def _content(row: Row, words: Sequence[str]) -> tuple[dict[str, Any], list[str]]:
    """Kind and first parameter, and what is wrong with it."""
    try:
        changes = words and _CHANGE.fullmatch(words[0]) and row.name == "masquerade"
        more = {"change": _changes(words)} if changes else _first(row, words)
    except ValueError as error:
        return {"kind": row.name}, [str(error)]
    return {"kind": row.name, **more}, []


def _no_kind(words: Sequence[str]) -> tuple[list[str], str]:
    """Words of the place of a line without a kind, and what to say of the one that may have been meant as
    it."""
    strange = [
        at for at, word in enumerate(words) if not _PLACES.fullmatch(word) and not _is_surely_a_place(word)
    ]
    lower = [at for at in strange if words[at] != words[at].upper()]  # messages are in capitals
    for at in lower or strange:
        if near := nearest(words[at], WORDS):
            return list(words[:at]), f"'{words[at]}' is no kind of fault; did you mean '{near}'?"
    if strange:
        at = (lower or strange)[-1]
        return list(words[:at]), f"'{words[at]}' is no kind of fault; kinds: gnss-hil faults list"
    said = " ".join(words)
    return list(
        words
    ), f"'{said}': which kind of fault? PLACE KIND, as in rx2 off; kinds: gnss-hil faults list"


_PLACES = re.compile(r"(rx|ch)\d+.*|[A-Za-z]\d\d(,.*)?|0[xX].*", re.IGNORECASE)
"""Words that were meant as a place, whether there is such a one or not."""


def _is_surely_a_place(word: str) -> bool:
    """Whether a word is a place, and not perhaps the name of an antenna."""
    try:
        found = places.parse([word])
    except ValueError:
        return False
    return not any(isinstance(one, str) for one in found.get("receiver", ()))


def _changes(words: Sequence[str]) -> list[dict[str, Any]]:
    """Changes of signals, each from a word that names one on."""
    groups: list[list[str]] = []
    for word in words:
        if _CHANGE.fullmatch(word):
            groups.append([word])
        else:
            groups[-1].append(word)
    return [signals.parse(" ".join(group)) for group in groups]


def _first(row: Row, words: Sequence[str]) -> dict[str, Any]:
    """The first parameter of a kind from the words behind its name."""
    if not words:
        return {}
    if not row.first:
        raise ValueError(f"{row.name} takes no value, found '{words[0]}'")
    value, *unit = words
    allowed = [name for name, end in _UNITS.items() if row.first.endswith(f"_{end}")]
    glued = re.fullmatch(r"([+-]?\d+(?:\.\d+)?)([A-Za-z/]+)", value)
    if glued and allowed and allowed != ["s"]:  # spans of time have units of their own, glued
        value, unit = glued[1], [glued[2], *unit]
    if len(unit) > 1:
        raise ValueError(f"{row.name}: '{' '.join(unit[1:])}' behind its value; keys are written KEY=VALUE")
    if unit and unit[0] not in allowed:
        units = f"allowed is {' or '.join(allowed)}" if allowed else "it takes no unit"
        raise ValueError(f"{row.name}: its value is {row.first}, found '{value} {unit[0]}'; {units}")
    return {row.first: _value(value)}


def _pairs(words: Sequence[str], row: Row) -> tuple[dict[str, Any], list[str]]:
    """Keys and values, those of expectations and of the protection in their tables; what is wrong."""
    found: dict[str, Any] = {}
    wrong: list[str] = []
    spoken: dict[str, str] = {}
    for word in words:
        key, _, text = word.partition("=")
        if key in spoken:
            wrong.append(f"'{spoken[key]}' and '{word}': one of them")
            continue
        spoken[key] = word
        if key in _EXPECTED:
            value = text.split(",") if key == "detected_by" else _value(text)
            found.setdefault("expect", {})[key] = value
        elif key in row.params.model_fields or key in _COMMON:
            found[key] = text if key in _COMMON else _value(text, key)
        elif key in (*_HEADER, "after") and "protection" in row.params.model_fields:
            found.setdefault("protection", {})[key] = _value(text)
        else:
            own = [name for name in row.params.model_fields if name not in Fault.model_fields]
            header = [*_HEADER, "after"] if "protection" in own else []
            known = [*own, *header, *_EXPECTED]
            wrong.append(f"{row.name} has no key '{key}'; {did_you_mean(key, known)}")
    return found, wrong


_TEXTS = ("data", "flip", "message", "satellite")
"""Keys whose values are text though they may look like numbers."""


def _value(text: str, key: str = "") -> Any:
    """A number, true or false, names with commas, or text."""
    if key in _TEXTS:
        return text
    if text in ("true", "false"):
        return text == "true"
    if re.fullmatch(r"0[xX][0-9a-fA-F]+", text):
        return int(text, 16)
    if re.fullmatch(r"[+-]?\d+", text):
        return int(text)
    if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", text):
        return float(text)
    return text.split(",") if "," in text else text


def line(fault: Fault) -> str:
    """A fault as a line that `parse` reads to the same fault; ValueError if there is none."""
    row, given = KINDS[fault.kind], fault.model_fields_set
    words: list[str] = []
    default = row.params.model_fields["on"].default
    if fault.on != default or "on" in given:
        words.append(places.text(fault.on))
    own = [name for name in row.params.model_fields if name not in (*Fault.model_fields, "protection")]
    if row.name == "masquerade":
        changes = cast(Masquerade, fault).change
        if not all("." in one.signal for one in changes):
            raise ValueError("a change of a signal without its message has no line")
        words += [signals.text(one) for one in changes]
    else:
        words.append(row.name)
        own = [name for name in own if _differs(fault, name)]
        if row.first in own:
            words.append(_said(getattr(fault, row.first)))
        words += [f"{name}={_said(getattr(fault, name))}" for name in own if name != row.first]
    words += _protection_words(fault, row)
    words += [f"{name}={value}" for name in _COMMON if (value := getattr(fault, name)) is not None]
    for name in _EXPECTED:
        value = getattr(fault.expect, name)
        words += [f"{name}={_said(value)}"] if value not in (None, ()) else []
    return " ".join(filter(None, [*words, when.text(fault.at)]))


def _differs(fault: Fault, name: str) -> bool:
    field = type(fault).model_fields[name]
    return field.is_required() or getattr(fault, name) != field.get_default(call_default_factory=True)


def _protection_words(fault: Fault, row: Row) -> list[str]:
    if "protection" not in row.params.model_fields:
        return []
    how, default = cast(Altering, fault).protection, row.params.model_fields["protection"].default
    if how == default:
        return []
    usual = Protection()
    return [
        f"{name}={_said(getattr(how, name))}"
        for name in Protection.model_fields
        if name == "crc" or getattr(how, name) != getattr(usual, name)
    ]


def _said(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return ",".join(map(_said, value))
    return f"{value:.12g}" if isinstance(value, float) else str(value)
