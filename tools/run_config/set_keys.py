"""`--set KEY=VALUE`: any key of a scenario, by its dotted path, as the file would have it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, cast

from gnss_hil.dbc.common import model_tree
from gnss_hil.dbc.common.model_tree import Key
from gnss_hil.dbc.common.near import nearest
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.common.errors import Mistake

_PART = re.compile(r'(?:"([^"]*)"|([^".=\s]+))(?:\.|$)')

Sets = Sequence[tuple[str, str]]
"""Path and value of each, as typed."""


def parsed(key: str) -> tuple[Key, ...]:
    """A dotted path: names, names in quotes, numbers of rows; Mistake if it is none."""
    keys: list[Key] = []
    at = 0
    while at < len(key) and (match := _PART.match(key, at)):
        quoted, bare = match.groups()
        keys.append(int(bare) if bare and bare.isascii() and bare.isdigit() else quoted or bare)
        at = match.end()
    if at < len(key) or not keys or key.endswith("."):
        raise Mistake(f"--set {key}: not a path of keys, as in craft.0.orbit.altitude_km")
    return tuple(keys)


def apply(document: dict[str, Any], sets: Sets) -> None:
    """Put values into a scenario's document, in place; Mistake names a path that no scenario has."""
    paths = [parsed(key) for key, _ in sets]
    for (key, _), path in zip(sets, paths, strict=True):
        if paths.count(path) > 1:
            raise Mistake(f"--set {key}: given {paths.count(path)} times")
    for (key, text), path in zip(sets, paths, strict=True):
        _put(document, path, _value(text, _kind(path, key)), key)


def _kind(path: Sequence[Key], key: str) -> Any:
    """What stands at a path of a scenario; Mistake if nothing does."""
    kind: Any = Scenario
    for number, part in enumerate(path):
        inner = model_tree.inside(kind, part)
        if inner is None:
            raise Mistake(f"--set {key}: {_unknown(path, number, kind)}")
        kind = inner
    return kind


def _unknown(path: Sequence[Key], number: int, kind: Any) -> str:
    """Why a scenario has nothing at the part of a path that is wrong."""
    part, where = path[number], ".".join(map(str, path[:number])) or "a scenario"
    if model_tree.is_list(kind):
        return f"{where} is a list: a number of a row comes next, as in {where}.0, found '{part}'"
    if not model_tree.is_table(kind):
        return f"{where} is no table, '{part}' cannot be in it"
    return f"{where} has no key '{part}'; {_meant(path[:number], str(part), kind)}"


def _meant(above: Sequence[Key], part: str, kind: Any) -> str:
    """The nearest key here or anywhere, or all there are here."""
    here = model_tree.keys_of(kind)
    anywhere = {str(path[-1]): ".".join(map(str, path)) for path, _ in model_tree.values(Scenario)}
    near = nearest(part, [*here, *anywhere])
    if near is None:
        return f"allowed are {', '.join(here)}"
    return f"did you mean '{'.'.join(map(str, (*above, near))) if near in here else anywhere[near]}'?"


def _value(text: str, kind: Any) -> Any:
    """What a text means where this kind of value stands, as TOML; text needs no quotes."""
    if model_tree.is_text(kind) and not text.startswith(('"', "'")):
        return text
    with suppress(tomllib.TOMLDecodeError, RecursionError):
        found = tomllib.loads(f"x = {text}")
        if found.keys() == {"x"}:  # a value, not more lines of a file
            return found["x"]
    return text


def _put(document: dict[str, Any], path: Sequence[Key], value: Any, key: str) -> None:
    owner: Any = document
    for number, part in enumerate(path):
        if isinstance(part, int) and not (isinstance(owner, list) and part < len(owner)):
            where = ".".join(map(str, path[:number]))
            rows = f"rows 0 to {len(owner) - 1}" if owner else "no rows in the scenario; set it as a list"
            raise Mistake(f"--set {key}: {where} has {rows}")
        if number == len(path) - 1:
            cast(Any, owner)[part] = value
            return
        owner = _below(owner, part, path[number + 1], key)


def _below(owner: Any, part: Any, following: Key, key: str) -> Any:
    """The table or list at a part of a path, made if it is not there; a switch becomes its table."""
    found = owner[part] if isinstance(part, int) else owner.get(part)
    if isinstance(found, bool) and isinstance(following, str):
        found = owner[part] = {"enabled": found}
    elif found is None and isinstance(following, str):
        found = owner[part] = {}
    elif found is None:
        found = owner[part] = []
    if not isinstance(found, dict | list) or isinstance(following, str) is not isinstance(found, dict):
        raise Mistake(f"--set {key}: the scenario has {found!r} at {part}")
    return found
