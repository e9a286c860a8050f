"""Files that a scenario names: beside it, or in the folder of real data.

The folder of real data is the environment variable GNSS_HIL_DATA; the project ships no measurements.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common import systems
from gnss_hil.emulator.config.tables import ScenarioError

DATA = "GNSS_HIL_DATA"

_KINDS = ("oem", "tle", "csv")

PLACES: tuple[tuple[str, ...], ...] = (
    ("time", "orientation"),
    *(("sky", system.name) for system in systems.tracked()),
    ("sky", "orbits"),
    ("sky", "almanac"),
    ("sky", "factors", "ionosphere", "files"),
    *(("craft", "trajectory", kind) for kind in _KINDS),
    ("craft", "observations", "file"),
    *(("craft", "observations", "reference", kind) for kind in _KINDS),
    ("craft", "attitude", "file"),
    ("craft", "factors", "receive_pattern", "pattern"),
    ("craft", "factors", "receive_pattern", "antennas"),
    ("craft", "structure"),
)
"""Where a scenario names files; `craft` is every craft."""

MAY_SHIP = {"pattern", "antennas", "structure"}
"""Keys whose values may be names of what ships with the bench."""

_NO_FILES = ("nominal", "none")


def anchor(document: dict[str, Any], folder: Path) -> dict[str, str]:
    """Make the names of files in a scenario's document absolute, in place.

    A name is looked for in `folder`, then in the folder of real data. One that is in neither may be
    that of something that ships; else it is left where it would be in `folder`. Those are returned with
    what to say of them (`refuse_missing`): a command line may name others instead.
    """
    data = os.environ.get(DATA)
    folders = [folder, *([Path(data)] if data else [])]
    missing: dict[str, str] = {}

    def absolute(name: Any, may_ship: bool) -> Any:
        if isinstance(name, list):
            return [absolute(item, may_ship) for item in name]
        if isinstance(name, dict):
            return {key: absolute(item, may_ship) for key, item in name.items()}
        if not isinstance(name, str) or name in _NO_FILES:
            return name
        found = next((place / name for place in folders if (place / name).is_file()), None)
        if found is None and may_ship:
            return name
        path = (found or folder / name).resolve()
        if not path.exists():
            missing[str(path)] = _not_found(name, path, data)
        return str(path)

    for keys in PLACES:
        for owner in _owners(document, keys[:-1]):
            if keys[-1] in owner:
                owner[keys[-1]] = absolute(owner[keys[-1]], keys[-1] in MAY_SHIP)
    return missing


def refuse_missing(document: dict[str, Any], missing: Mapping[str, str]) -> None:
    """ScenarioError, a line each, if a document still names files that `anchor` did not find."""
    lines = [
        f"{'.'.join(keys)}: {missing[name]}"
        for keys in PLACES
        for owner in _owners(document, keys[:-1])
        for name in _names(owner.get(keys[-1]))
        if name in missing
    ]
    if lines:
        raise ScenarioError("\n".join(dict.fromkeys(lines)))


def _names(value: Any) -> Iterator[str]:
    """The names in a value: itself, or those in a list or table."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, list | dict):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _names(item)


def _not_found(name: str, path: Path, data: str | None) -> str:
    """What to say of a file that is nowhere; a relative name may be one of the folder of real data."""
    said = f"{path}: No such file or directory"
    if Path(name).is_absolute():
        return said
    if data:
        return f"{said}, nor {name} in {DATA} ({data})"
    return f"{said}; {DATA}, the folder of real data where {name} may be, is not set"


def leaves(document: Any) -> Iterator[tuple[Any, Any]]:
    """Where a scenario's document names a file: the table or list, and the key or number in it."""
    for keys in PLACES:
        for owner in _owners(document, keys[:-1]):
            if owner.get(keys[-1]) is not None:
                yield from _texts(owner, keys[-1])


def _texts(owner: Any, key: Any) -> Iterator[tuple[Any, Any]]:
    value = owner[key]
    if isinstance(value, str):
        yield owner, key
    elif isinstance(value, list | dict):
        for inner in range(len(value)) if isinstance(value, list) else value:
            yield from _texts(value, inner)


def _owners(table: Any, keys: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """The tables at a path of keys; an array of tables stands for each of its rows."""
    if isinstance(table, list):
        for row in table:
            yield from _owners(row, keys)
    elif isinstance(table, dict):
        if not keys:
            yield table
        elif keys[0] in table:
            yield from _owners(table[keys[0]], keys[1:])
