"""Text for a window of a given size: styled pieces, lines that are never wider than the window.

rich was measured first: a table of four antennas takes it 32 ms a draw, 13 % of a core at four draws a
second, and 0.06 s to import. These few functions take 3 ms.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

STYLES = {"": "", "title": "7", "head": "1", "dim": "2", "warn": "33", "bad": "31"}
"""Style -> SGR parameter (ECMA-48, 8.3.117)."""

GAP = "  "


class Span(NamedTuple):
    """A piece of a line; `style` is a key of STYLES."""

    text: str
    style: str = ""


Line = tuple[Span, ...]


def printable(text: str) -> str:
    """Without what a terminal would obey: files and buses bring names of all kinds."""
    return "".join(c if c.isprintable() else "?" for c in text)


def line(*parts: str | Span) -> Line:
    return tuple(Span(printable(part[0]), part[1]) if isinstance(part, Span) else Span(printable(part))
                 for part in parts)  # fmt: skip


def width_of(spans: Line) -> int:
    return sum(len(span.text) for span in spans)


def plain(spans: Line) -> str:
    """A line without its styles."""
    return "".join(span.text for span in spans)


def fitted(spans: Line, width: int) -> Line:
    """Cut or padded to exactly `width` characters."""
    kept, room = [], width
    for span in spans:
        kept.append(Span(span.text[:room], span.style))
        room -= len(kept[-1].text)
    return (*kept, Span(" " * room))


def parted(parts: Iterable[str | Span], width: int) -> Line:
    """Parts one after another, as many as fit whole, the first one cut if need be."""
    kept: list[Span] = []
    for part in line(*parts):
        between = [Span(GAP)] if kept else []
        if kept and width_of((*kept, *between, part)) > width:
            break
        kept += [*between, part]
    return fitted(tuple(kept), width)


def beside(blocks: Sequence[Sequence[Line]], width: int) -> list[Line]:
    """Blocks of lines side by side, each `width` wide."""
    height = max(map(len, blocks), default=0)
    blank = line("")
    lines = []
    for i in range(height):
        cells = [fitted(block[i] if i < len(block) else blank, width) for block in blocks]
        lines.append(tuple(s for k, cell in enumerate(cells) for s in ((Span(GAP), *cell) if k else cell)))
    return lines


def wrapped(text: str, width: int) -> list[str]:
    """Pieces of at most `width` characters; a long path must stay whole enough to be copied."""
    text = printable(text)
    return [text[i : i + width] for i in range(0, len(text), max(width, 1))]


def painted(spans: Line, colour: bool) -> str:
    """A line as a terminal wants it."""
    if not colour:
        return plain(spans)
    return "".join(f"\x1b[{STYLES[style]}m{text}\x1b[0m" if style and text else text for text, style in spans)
