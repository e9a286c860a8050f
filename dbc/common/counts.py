"""Counts in words: "1 epoch", "2 epochs", "0 epochs"."""

from __future__ import annotations


def noun(count: float, one: str, many: str = "") -> str:
    """The word of so many: `one` of one, else `many`, or `one` with an s."""
    return one if count == 1 else many or f"{one}s"


def so_many(count: int, one: str, many: str = "") -> str:
    """The number and its word."""
    return f"{count} {noun(count, one, many)}"
