"""Figures as a person reads them, and columns of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def figure(value, digits: int = 2) -> str:
    if value is None:
        return "-"
    return (
        f"{value:,.{digits}f}".replace(",", " ")
        if isinstance(value, float)
        else f"{value:,}".replace(",", " ")
    )


def small(value) -> str:
    """A figure of any size, never with an exponent."""
    if value is None:
        return "-"
    if 0 < abs(value) < 0.01:
        return f"{value:.5f}"
    return f"{value:.3f}" if abs(value) < 1 else f"{value:.2f}" if abs(value) < 10 else f"{value:.1f}"


def percent(part: int, whole: int) -> str:
    """A share with one decimal, never rounded up: what is not all of them is not 100 %."""
    return f"{1000 * part // whole / 10:.1f}" if whole else "-"


def aligned(rows: Iterable[Sequence[str]]) -> str:
    """Cells in columns for a terminal, the first flush left, the others right."""
    rows = list(rows)
    first, *others = (max(map(len, column)) for column in zip(*rows, strict=True))
    return "\n".join(
        f"{name:<{first}}" + "".join(f"  {cell:>{width}}" for cell, width in zip(cells, others, strict=True))
        for name, *cells in rows
    )
