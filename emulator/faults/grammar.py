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
from collections.abc import Sequence
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
    """The table of a fault file that a line stands for; ValueError with one line if it stands for none."""
    words = _joined(text).split()
    if not words:
        raise ValueError("no fault: PLACE KIND [VALUE] [@TIME], as in rx2 off @2m+30s")
    time, rest = _time_apart(words)
    pairs = [word for word in rest if _is_pair(word)]
    plain = [word for word in rest if not _is_pair(word) and word.lower() not in NOISE]
    place, found = _kind_of(plain)
    document = {**found, **_pairs(pairs, KINDS[found["kind"]])}
    if place:
        document["on"] = " ".join(place)
    if time:
        document["at"] = " ".join(time)
    return document


def _joined(text: str) -> str:
    """With no blanks around = and behind @, but in what is compared."""
    head, lead, tail = _split_at_trigger(text)
    joined = _JOINED.sub(r"\1", head)
    return re.sub(r"@\s+", "@", joined) + lead + tail


def _split_at_trigger(text: str) -> tuple[str, str, str]:
    match = re.search(r"\s(after|when)\s", text)
    return (text, "", "") if match is None else (text[: match.start()], match[0], text[match.end() :])


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


def _kind_of(words: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """Words of the place; kind and first parameter."""
    for at, word in enumerate(words):
        if _CHANGE.fullmatch(word):
            before = [one for one in words[:at] if one != "masquerade"]
            return before, {"kind": "masquerade", "change": _changes(words[at:])}
        if word == "masquerade" and at + 1 < len(words) and _CHANGE.fullmatch(words[at + 1]):
            continue
        if word in WORDS:
            place = list(words[:at])
            row = called(word, places.parse(place))
            assert row is not None, "a word of a kind"
            return place, {"kind": row.name, **_first(row, words[at + 1 :])}
    raise ValueError(_no_kind(words))


def _no_kind(words: Sequence[str]) -> str:
    """What to say of words without a kind: the one that may have been meant as it."""
    for word in words:
        if not _is_surely_a_place(word):
            near = nearest(word, WORDS)
            meant = f"did you mean '{near}'?" if near else "kinds: gnss-hil faults list"
            return f"'{word}' is no kind of fault; {meant}"
    said = " ".join(words)
    return f"'{said}': which kind of fault? PLACE KIND, as in rx2 off; kinds: gnss-hil faults list"


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


def _pairs(words: Sequence[str], row: Row) -> dict[str, Any]:
    """Keys and values; those of expectations and of the protection in their tables."""
    found: dict[str, Any] = {}
    for word in words:
        key, _, text = word.partition("=")
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
            raise ValueError(
                f"{row.name} has no key '{key}'; {did_you_mean(key, [*own, *header, *_EXPECTED])}"
            )
    return found


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
