"""Sequence charts of `sequences.md`, which are Mermaid's: lifelines, arrows, notes, and time going down."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

from gnss_hil.tools.report.markup import Markup, figure, own, svg, tag

EMULATOR, FLIGHT = "emulator", "flight software"

_WIDTH, _LEFT, _RIGHT = 900, 230, 670
_TOP, _STEP, _NOTE = 34, 30, 22
_LINE = {EMULATOR: _LEFT, FLIGHT: _RIGHT}

_CHART = re.compile(r"^## (.+?)\n\n(.+?)\n\n```mermaid\n(.+?)```", re.MULTILINE | re.DOTALL)
_STEPS = re.compile(
    r"^ +(?:(?P<by>[EF])(?P<arrow>->>|-x)[EF]|Note (?P<beside>left of E|right of F|over E,F)): "
    r"(?P<words>.+)$",
    re.MULTILINE,
)


@dataclass(frozen=True, slots=True)
class Sent:
    """A frame, or several, from one side to the other; `lost` on the way."""

    by: str
    frames: str
    lost: bool = False


@dataclass(frozen=True, slots=True)
class Does:
    """What one side does, beside its line."""

    side: str
    what: str


@dataclass(frozen=True, slots=True)
class Pause:
    """Time passes; both lines are broken."""

    why: str


Step = Sent | Does | Pause


@dataclass(frozen=True, slots=True)
class Chart:
    title: str
    caption: str
    steps: tuple[Step, ...]

    @property
    def arrows(self) -> list[Sent]:
        return [step for step in self.steps if isinstance(step, Sent)]


@cache
def charts() -> dict[str, Chart]:
    """Title -> chart, in the order of the file."""
    page = own("icd", "sequences.md")
    return {
        title: Chart(title, " ".join(caption.split()), tuple(map(_step, _STEPS.finditer(steps))))
        for title, caption, steps in _CHART.findall(page)
    }


def _step(line: re.Match[str]) -> Step:
    if line["by"]:
        return Sent(EMULATOR if line["by"] == "E" else FLIGHT, line["words"], line["arrow"] == "-x")
    if line["beside"] == "over E,F":
        return Pause(line["words"])
    return Does(EMULATOR if line["beside"] == "left of E" else FLIGHT, line["words"])


def _sent(step: Sent, y: float) -> Iterator[Markup]:
    here = _LINE[step.by]
    there = _LEFT + _RIGHT - here
    forward = 1 if there > here else -1
    tip = there if not step.lost else (here + there) / 2 + forward * 110
    base = y + 24
    yield tag.text(step.frames, x=(_LEFT + _RIGHT) / 2, y=base - 6, class_="label")
    yield tag.path(
        d=f"M{here} {base} L{tip - forward * 8:g} {base}", class_="arrow lost" if step.lost else "arrow"
    )
    if step.lost:
        yield tag.path(d=f"M{tip - 6:g} {base - 6} l12 12 m0 -12 l-12 12", class_="cross")
    else:
        yield tag.path(d=f"M{tip} {base} l{-forward * 9} -4.5 v9 z", class_="tip")


def _does(step: Does, y: float) -> Iterator[Markup]:
    left = step.side == EMULATOR
    x = _LEFT - 12 if left else _RIGHT + 12
    yield tag.text(step.what, x=x, y=y + 15, class_="does left" if left else "does")
    yield tag.circle(cx=_LINE[step.side], cy=y + 11, r=3.5, class_="dot")


def _pause(step: Pause, y: float) -> Iterator[Markup]:
    for x in _LINE.values():
        yield tag.rect(x=x - 4, y=y + 8, width=8, height=14, class_="gap")
    yield tag.text(step.why, x=(_LEFT + _RIGHT) / 2, y=y + 19, class_="pause")


_DRAWN = {Sent: (_sent, _STEP), Does: (_does, _NOTE), Pause: (_pause, _STEP)}
"""How a step is drawn, and its height."""


def draw(chart: Chart) -> Markup:
    """Every arrow bears `data-by` and `data-frames`."""
    y, drawn = _TOP, []
    for step in chart.steps:
        marks = {"data_by": step.by, "data_frames": step.frames} if isinstance(step, Sent) else {}
        how, height = _DRAWN[type(step)]
        drawn.append(tag.g(how(step, y), **marks))
        y += height
    bottom = y + 12
    lines = [tag.line(x1=x, x2=x, y1=_TOP - 6, y2=bottom, class_="life") for x in _LINE.values()]
    heads = [
        (
            tag.rect(x=x - 75, y=2, width=150, height=26, rx=3, class_="head"),
            tag.text(name, x=x, y=20, class_="headname"),
        )
        for name, x in _LINE.items()
    ]
    drawing = svg(_WIDTH, bottom + 4, lines, heads, drawn, title=chart.title, class_="sequence")
    return figure(drawing, chart.caption)
