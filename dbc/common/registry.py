"""Registries: what the bench offers by name (policies, error factors, search rules, ...), one table each.

A row has at least a `name`; validation, `--help` choices and documents are made from the table.
"""

from __future__ import annotations

from typing import Protocol, TypeVar


class Named(Protocol):
    @property
    def name(self) -> str: ...


Row = TypeVar("Row", bound=Named)


def table(*rows: Row) -> dict[str, Row]:
    """Rows by name, in order; ValueError if two have the same."""
    found = {row.name: row for row in rows}
    if len(found) != len(rows):
        names = [row.name for row in rows]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"two rows are named '{twice}'")
    return found
