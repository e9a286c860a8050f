"""The bit layout of a message, drawn: a row for each byte, the highest bit to the left."""

from __future__ import annotations

from collections.abc import Iterator

from cantools.database.can import Signal

from gnss_hil.tools.icd.contract import Layout
from gnss_hil.tools.report.markup import Markup, svg, tag

_HEADER = frozenset({"e2e_crc", "e2e_counter", "epoch_mod16"})
_TONES = 6

_CELL, _ROW = 62, 34
_LEFT, _TOP = 64, 26
_WIDTH, _HEIGHT = _LEFT + 8 * _CELL + 2, _TOP + 8 * _ROW + 2
_LETTER = 7.2
"""Width of a letter of the monospaced labels at 12 px, rounded up."""


def tones(signals: list[Signal]) -> dict[str, str]:
    """Style class of each signal: `h` for the protection header, else one of the tones in turn."""
    payload = [s.name for s in signals if s.name not in _HEADER]
    return {s.name: "h" for s in signals if s.name in _HEADER} | {
        name: f"t{k % _TONES}" for k, name in enumerate(payload)
    }


def place(bit: int) -> tuple[float, float]:
    """Upper left corner of the cell of bit 0 to 63; bit 0 is the lowest of byte 0."""
    return _LEFT + (7 - bit % 8) * _CELL, _TOP + bit // 8 * _ROW


def runs(signal: Signal) -> Iterator[tuple[int, int]]:
    """First and last bit of each piece of a little-endian signal within one byte."""
    bit, end = signal.start, signal.start + signal.length
    while bit < end:
        stop = min(end, bit - bit % 8 + 8)
        yield bit, stop - 1
        bit = stop


def _cells(signal: Signal, tone: str) -> Iterator[Markup]:
    for k in range(signal.length):
        x, y = place(signal.start + k)
        yield tag.rect(
            class_=tone, x=x, y=y, width=_CELL, height=_ROW,
            data_bit=signal.start + k, data_signal=signal.name, data_weight=k,
        )  # fmt: skip
        yield tag.text(k, x=x + _CELL - 4, y=y + _ROW - 4, class_="w")


def _free(signals: list[Signal]) -> Iterator[Markup]:
    used = {s.start + k for s in signals for k in range(s.length)}
    for bit in sorted(set(range(64)) - used):
        x, y = place(bit)
        yield tag.rect(class_="free", x=x, y=y, width=_CELL, height=_ROW)


def _outline_and_name(signal: Signal, anchor: str) -> Iterator[Markup]:
    pieces = list(runs(signal))
    named = max(pieces, key=lambda piece: piece[1] - piece[0])
    for piece in pieces:
        x, y = place(piece[1])
        width = (piece[1] - piece[0] + 1) * _CELL
        yield tag.rect(class_="o", x=x, y=y, width=width, height=_ROW)
        if piece == named:
            label = _fitted(signal.name, width)
            yield tag.a(tag.text(label, x=x + width / 2, y=y + 16, class_="name"), href=f"#{anchor}")
    for bit, mark in ((signal.start, "lsb"), (signal.start + signal.length - 1, "msb")):
        if signal.length > 1:
            x, y = place(bit)
            yield tag.text(mark, x=x + 4, y=y + _ROW - 4, class_="end")


def _fitted(name: str, width: float) -> str:
    """A name as it fits; the table below the drawing has it whole."""
    letters = int(width / _LETTER)
    return name if len(name) <= letters else name[: letters - 1] + "…"


def draw(layout: Layout) -> Markup:
    """Every cell bears `data-bit` (in the frame), `data-signal` and `data-weight` (its bit of the signal)."""
    signals = layout.signals
    tone = tones(signals)
    head = [
        tag.text(f"bit {7 - k}", x=_LEFT + (k + 0.5) * _CELL, y=_TOP - 8, class_="axis") for k in range(8)
    ]
    side = [tag.text(f"byte {k}", x=_LEFT - 10, y=_TOP + (k + 0.6) * _ROW, class_="side") for k in range(8)]
    return svg(
        _WIDTH, _HEIGHT, head, side, _free(signals),
        [_cells(s, tone[s.name]) for s in signals],
        [_outline_and_name(s, f"{layout.name}.{s.name}") for s in signals],
        title=f"Bit layout of {layout.name}", class_="bits",
    )  # fmt: skip
