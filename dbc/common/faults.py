"""What is wrong with a file's contents, for people: one line a fault."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, time
from typing import Any

from pydantic import BaseModel, ValidationError

from gnss_hil.dbc.common import model_tree
from gnss_hil.dbc.common.model_tree import Key
from gnss_hil.dbc.common.near import did_you_mean, nearest

_NOT_A_TABLE = ("model_type", "model_attributes_type", "dict_type")
_NOT_A_LIST = ("list_type", "tuple_type")
_LONGEST = 60
_MOST_PLACES = 3


def faults(
    error: ValidationError, origin: str, model: type[BaseModel] | None = None, whole: str = "file"
) -> list[str]:
    """One line for each fault pydantic found: file, key, what was found, what is allowed.

    model  of the whole file: a key that it has elsewhere, or under a similar name, is pointed to
    whole  how the file is called where no key is to blame; "" where the origin says it all
    """
    lines: dict[tuple[str, str, int], list[str]] = {}
    told = error.errors()
    paths = [_keys(fault["loc"], model, fault["type"] == "extra_forbidden") for fault in told]
    for fault, keys in zip(told, paths, strict=True):
        above = None if model is None else _table(model, fault["loc"][:-1])
        if fault["type"].endswith("_type") and any(_below(path, keys) for path in paths):
            continue  # it is of another kind, in which something is wrong
        key = ".".join(map(str, keys)) or whole
        # The kinds that a value may be of fail one by one: they are one fault.
        text, shown = _text(fault, keys, model, above)
        for number, one in enumerate(text.splitlines()):  # of what is text itself: several
            texts = lines.setdefault((key, shown, number), [])
            if one not in texts:
                texts.append(one)
    return [
        ": ".join(filter(None, (origin, key, f"{_either(texts)}{shown}")))
        for (key, shown, _), texts in lines.items()
    ]


_SHOULD = "input should be "


def _either(texts: Sequence[str]) -> str:
    """Several things that are allowed, in one sentence."""
    first, *others = texts
    return " or ".join([first, *(text.removeprefix(_SHOULD) for text in others)])


def _below(path: Sequence[Key], keys: Sequence[Key]) -> bool:
    return len(path) > len(keys) and list(path[: len(keys)]) == list(keys)


def _keys(loc: Sequence[Key], model: type[BaseModel] | None, strange: bool) -> list[Key]:
    """A path without the kinds that pydantic puts into it where several are allowed; strange: its last key is
    one that no model has."""
    if model is None:
        return list(loc)
    keys: list[Key] = []
    above: Any = model
    for number, part in enumerate(loc):
        tagged = None if above is None else model_tree.tagged(above, part)
        last = number == len(loc) - 1
        if tagged is not None and not last:
            above = tagged
            continue
        unknown = last and strange and above is not None and model_tree.is_table(above) and part != "[key]"
        inner = None if above is None else model_tree.inside(above, part)
        if above is None or unknown or inner is not None:
            keys.append(part)
            above = inner
    return keys


def _table(model: type[BaseModel], loc: Sequence[Key]) -> Any | None:
    """What stands at a path of pydantic, whose kinds are in it where several are allowed."""
    found: Any = model
    for part in loc:
        tagged = model_tree.tagged(found, part)
        inner = model_tree.inside(found, part) if tagged is None else tagged
        found = found if inner is None else inner
    return found


def _text(
    fault: Any, keys: Sequence[Key], model: type[BaseModel] | None, above: Any | None
) -> tuple[str, str]:
    """What is allowed, and what was found.

    above   the table that a key is in
    """
    kind, found = fault["type"], fault["input"]
    if kind == "missing":
        return "missing", ""
    if kind == "union_tag_invalid":
        context = fault["ctx"]
        known = [word.strip("'") for word in context["expected_tags"].split(", ")]
        key = context["discriminator"].strip("'")
        return f"no {key} '{context['tag']}'; {did_you_mean(context['tag'], known)}", ""
    if kind == "union_tag_not_found":
        return f"which {fault['ctx']['discriminator'].strip(chr(39))}? the key is missing", ""
    if kind == "extra_forbidden":
        return f"unknown key{_meant(keys, model, above)}", ""
    if kind in _NOT_A_TABLE:
        row = keys and isinstance(keys[-1], int)
        written = f"[{_header(keys)}]" if row else _header(keys)
        return f"must be a table, written {written}", _found(found)
    if kind in _NOT_A_LIST and isinstance(found, dict):
        return f"there may be several: write [{_header(keys)}]", f", found {_header(keys)}"
    if kind in _NOT_A_LIST:
        return "must be a list", _found(found)
    if kind == "value_error":  # ours, which may begin with a name
        return fault["msg"].removeprefix("Value error, "), _shown(found)
    message = fault["msg"]
    similar = _similar(fault) if kind == "literal_error" else ""
    return f"{message[:1].lower()}{message[1:]}", f"{_shown(found)}{similar}"


def _shown(found: Any) -> str:
    """What was found; nothing of what is too large to be shown."""
    return "" if isinstance(found, (dict, list, tuple, BaseModel)) else _found(found)


def _meant(keys: Sequence[Key], model: type[BaseModel] | None, above: Any | None) -> str:
    """Where an unknown key may have been meant."""
    name = str(keys[-1]) if keys else ""
    if model is None or not name:
        return ""
    here = model_tree.keys_of(above)
    near = nearest(name, here)
    if near:
        return f"; did you mean '{near}'?"
    places = [one for one in model_tree.elsewhere(model, name) if one != _header(keys[:-1])]
    if places and len(places) <= _MOST_PLACES:
        return f"; {' and '.join(places)} {'has' if len(places) == 1 else 'have'} one"
    return f"; allowed are {', '.join(here)}" if here else ""


def _similar(fault: Any) -> str:
    words = [word.strip("'") for word in fault["ctx"]["expected"].replace(" or ", ", ").split(", ")]
    near = nearest(fault["input"], words) if isinstance(fault["input"], str) else None
    return f"; did you mean '{near}'?" if near else ""


def _header(keys: Sequence[Key]) -> str:
    return model_tree.header(keys)


def _found(found: Any) -> str:
    return ", found a list" if isinstance(found, list | tuple) else f", found {_value(found)}"


def _value(found: Any) -> str:
    if isinstance(found, date | time):  # as the file has it, not as Python would
        return found.isoformat()
    text = repr(found)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
