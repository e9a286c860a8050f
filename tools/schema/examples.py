"""Examples of the keys' values: those of files that ship; for keys that none of them has, `examples.toml`."""

from __future__ import annotations

import tomllib
from importlib import resources
from typing import Any

from gnss_hil.tools.schema.json_schema import KINDS

_TEXT = resources.files("gnss_hil.tools.schema").joinpath("examples.toml").read_text("utf-8")

WRITTEN: dict[str, dict[str, Any]] = tomllib.loads(_TEXT)
"""Kind of file -> key with its path -> value. A test checks each against the schema."""

FIRST = ("soyuz", "soyuz-ms")
"""Files whose values are shown rather than others'."""


def examples(kind: str) -> dict[str, Any]:
    """Key with its path -> an example of its value, for keys that are written or in a file that ships."""
    found: dict[str, Any] = {}
    shipped = KINDS[kind].shipped()
    for path in sorted(shipped.values(), key=lambda path: path.stem not in FIRST):
        _collect(KINDS[kind].read(path), "", found)
    return {**found, **WRITTEN.get(kind, {})}


def _collect(table: dict[str, Any], path: str, found: dict[str, Any]) -> None:
    for name, value in table.items():
        key = f"{path}.{name}".lstrip(".")
        rows = value if isinstance(value, list) and value and isinstance(value[0], dict) else [value]
        for row in rows:
            if isinstance(row, dict):
                _collect(row, key, found)
            else:
                found.setdefault(key, value)
