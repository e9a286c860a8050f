"""The chain from frame to fix as one drawing: how much of what faults touched ended at which link."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate

from gnss_hil.tools.report.markup import Markup, svg, tag
from gnss_hil.tools.results.fault_chain import Stage
from gnss_hil.tools.results.figures import figure

_WIDTH, _BAR, _LINE, _TOP = 344.0, 16.0, 15.0, 20.0
_LEAST = 2.0
"""Width of what is there and would be narrower."""
_MOST_WHYS = 3


def drawing(stages: Sequence[Stage]) -> Markup:
    """A bar for each link: the part that goes on, and the part that ends there, with why; links are
    joined."""
    told = "; ".join(f"{one.name} {one.came}, {one.goes_on} {one.on}" for one in stages)
    tops = [_TOP + above for above in accumulate((_height(one) for one in stages), initial=0.0)]
    parts = [
        _stage(one, top, below if k + 1 < len(stages) else None)
        for k, (one, top, below) in enumerate(zip(stages, tops, tops[1:], strict=False))
    ]
    return svg(_WIDTH, tops[-1] - _TOP / 2, parts, title=f"From frame to fix: {told}", class_="chain")


def _height(stage: Stage) -> float:
    """From the top of its bar to that of the next one."""
    return _BAR + _LINE * max(1, len(_whys(stage))) + 28


def _stage(stage: Stage, top: float, next_top: float | None) -> Iterator[Markup]:
    on = _goes_on(stage)
    if next_top is not None and on:
        points = ((0, top + _BAR), (on, top + _BAR), (_WIDTH, next_top), (0, next_top))
        yield tag.polygon(points=" ".join(f"{x:g},{y:g}" for x, y in points), fill="var(--band-3)")
    yield _words(0, top - 6, stage.name, "ink")
    yield _words(_WIDTH, top - 6, figure(stage.came), "ink", "end", bold=True)
    if not stage.came:
        yield tag.rect(
            x=0.5, y=top + 0.5, width=_WIDTH - 1, height=_BAR - 1, fill="none", stroke="var(--rule)"
        )
        return
    yield tag.rect(x=0.0, y=top, width=on, height=_BAR, fill="var(--accent)")
    yield tag.rect(x=on, y=top, width=_WIDTH - on, height=_BAR, fill="var(--bad)")
    below = top + _BAR + _LINE - 1
    if stage.goes_on:
        yield _words(0, below, f"{figure(stage.goes_on)} {stage.on}", "accent")
    for line, words in enumerate(_whys(stage)):
        yield _words(_WIDTH, below + _LINE * line, words, "bad", "end")


def _goes_on(stage: Stage) -> float:
    """Width of the part that goes on; neither part that is there vanishes."""
    if not stage.came:
        return 0.0
    least = _LEAST if stage.goes_on else 0.0
    most = _WIDTH if stage.goes_on == stage.came else _WIDTH - _LEAST
    return min(max(_WIDTH * stage.goes_on / stage.came, least), most)


def _whys(stage: Stage) -> list[str]:
    """Why it ended, the most frequent on lines of their own, the rest together."""
    rows = [f"{figure(count)} {name.replace('_', ' ').lower()}" for name, count in stage.ended.items()]
    if len(rows) <= _MOST_WHYS:
        return rows
    rest = sum(list(stage.ended.values())[_MOST_WHYS - 1 :])
    return [*rows[: _MOST_WHYS - 1], f"{figure(rest)} otherwise"]


def _words(x: float, y: float, words: str, colour: str, anchor: str = "start", bold: bool = False) -> Markup:
    return tag.text(
        words, x=x, y=y, fill=f"var(--{colour})", text_anchor=anchor, font_weight="650" if bold else None
    )
