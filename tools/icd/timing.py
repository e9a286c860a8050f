"""What an epoch costs: its frames on a time axis in bit times, and the budget as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.report.markup import Markup, svg, table, tag, text
from gnss_hil.tools.run_config.frame_budget import WORST_BITS, Budget, Row, typical_bits

_WIDTH, _LEFT, _RIGHT = 900, 60, 90
_BAR, _GAP_SHARE = 34, 0.12
_TONE = {
    "time mark": 0, "commands and answers": 1, "attitude": 4, "measurements": 5, "tags and status": 2,
    "almanac": 6, "heartbeats": 7, "navigation": 3, "refusals": 3,
}  # fmt: skip
_ORDER = {
    "emulator": ("time mark", "attitude", "measurements", "tags and status", "almanac", "heartbeats"),
    "flight": ("navigation", "heartbeats"),
}
"""Order on the bus of a steady epoch. Measurements, tags and status, which alternate, are summed here."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Frames that go one after another, from a side of the bus."""

    what: str
    frames: int


def _short(row: Row) -> str:
    return row.what.split(",")[0]


def pieces(budget: Budget, side: str) -> list[Piece]:
    """A steady epoch's frames of one side, in the order in which they go."""
    counted = {_short(row): row for row in budget.rows if not row.event}
    rows = ((what, counted[what]) for what in _ORDER[side])
    return [Piece(what, row.flight if side == "flight" else row.frames - row.flight) for what, row in rows]


def _scale(budget: Budget, bits: float) -> float:
    """Pixels of a bit, so that both blocks and a gap between them fill the width."""
    return (_WIDTH - _LEFT - _RIGHT) * (1 - _GAP_SHARE) / (budget.frames(False) * bits)


def _blocks(sequence: Sequence[Piece], x: float, y: float, bits: float, scale: float) -> Iterator[Markup]:
    for piece in sequence:
        width = piece.frames * bits * scale
        says = f"{piece.what}: {so_many(piece.frames, 'frame')}, {piece.frames * bits:.0f} bit times"
        yield tag.g(
            tag.title(says),
            tag.rect(
                class_=f"g{_TONE[piece.what]} piece", x=x, y=y, width=width, height=_BAR,
                data_what=piece.what, data_frames=piece.frames,
            ),
        )  # fmt: skip
        if width > 60:
            yield tag.text(piece.what, x=x + width / 2, y=y + 15, class_="label")
            yield tag.text(so_many(piece.frames, "frame"), x=x + width / 2, y=y + 28, class_="onbar")
        x += width


def _mark(x: float, y: float, label: str, bits: float, since: str = "", side: str = "mid") -> Markup:
    """An instant: its name above the bar, below it the time and the bit times."""
    times = f"{1e3 * bits / BIT_RATE:.2f} ms", f"{bits:.0f} bits"
    lines = [f"{since} + {time}" if since and bits else since or time for time in times]
    return tag.g(
        tag.line(x1=x, x2=x, y1=y - 12, y2=y + _BAR + 14, class_="tick"),
        tag.text(label, x=x, y=y - 17, class_=f"instant {side}"),
        tag.text(lines[0], x=x, y=y + _BAR + 28, class_=f"mark {side}"),
        tag.text(lines[1], x=x, y=y + _BAR + 42, class_=f"mark {side}") if lines[1] != lines[0] else None,
    )


def _zoom(budget: Budget, bits: float, y: float) -> Iterator[Markup]:
    scale = _scale(budget, bits)
    first, second = pieces(budget, "emulator"), pieces(budget, "flight")
    sent, answered = (sum(p.frames for p in side) * bits for side in (first, second))
    gap_begins = _LEFT + sent * scale
    gap_ends = gap_begins + (_WIDTH - _LEFT - _RIGHT) * _GAP_SHARE
    end = gap_ends + answered * scale
    yield from _blocks(first, _LEFT, y, bits, scale)
    yield tag.rect(class_="think", x=gap_begins, y=y, width=gap_ends - gap_begins, height=_BAR)
    yield tag.text("fix, assignment", x=(gap_begins + gap_ends) / 2, y=y + 21, class_="mark mid")
    yield from _blocks(second, gap_ends, y, bits, scale)
    yield _mark(_LEFT, y, "time mark", 0.0, side="begin")
    yield _mark(gap_begins, y, "SYNC", sent)
    yield _mark(gap_ends, y, "answer", 0.0, "t", side="before")
    yield _mark(end, y, "DONE", answered, "t", side="begin")


def _whole(budget: Budget, bits: float, y: float) -> Iterator[Markup]:
    """The epoch to scale: how much of it the bus is busy."""
    width = _WIDTH - _LEFT - _RIGHT
    busy = width * min(1.0, budget.frames(False) * bits / (BIT_RATE * budget.interval_s))
    yield tag.rect(class_="free", x=_LEFT, y=y, width=width, height=14)
    yield tag.rect(class_="g5", x=_LEFT, y=y, width=busy, height=14)
    yield tag.text("epoch", x=_LEFT - 8, y=y + 12, class_="side")
    for k in range(11):
        x = _LEFT + width * k / 10
        yield tag.line(x1=x, x2=x, y1=y - 5, y2=y, class_="tick")
        yield tag.text(f"{budget.interval_s * k / 10:g} s", x=x, y=y - 9, class_="mark mid")
    fan = f"M{_LEFT} {y + 14} v30 M{_LEFT + busy:g} {y + 14} L{_WIDTH - _RIGHT} {y + 44}"
    yield tag.path(d=fan, class_="fan")


def draw(budget: Budget) -> Markup:
    """A steady epoch: above to scale, below its busy part. Pieces bear `data-what` and `data-frames`."""
    bits = typical_bits()
    return svg(
        _WIDTH, 185, _whole(budget, bits, 22), _zoom(budget, bits, 100),
        title="An epoch on a time axis", class_="timing",
    )  # fmt: skip


def budget_table(budget: Budget) -> Markup:
    """The same figures as `gnss-hil icd budget`."""
    typical = typical_bits()

    def sums(frames: int) -> tuple[str, str]:
        return f"{frames * typical:.0f}", str(frames * WORST_BITS)

    rows = [
        (text((tag.span(class_=f"chip g{_TONE[_short(r)]}"), r.what)), r.frames, *sums(r.frames))
        for r in budget.rows
    ]
    steady, every = budget.frames(False), budget.frames(True)
    rows += [
        (tag.b(what), tag.b(frames), *map(tag.b, sums(frames)))
        for what, frames in (("steady", steady), ("with every event at once", every))
    ]
    head = ("frames of an epoch", "frames", "bits, typical", "bits, at most")
    return text((table(head, rows, (1, 2, 3)), tag.p(budget.loads())))
