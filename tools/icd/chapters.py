"""The chapters of the document: the words of `document.md`, and in its places what is drawn and computed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

from gnss_hil.tools.icd import messages, prose, protection, sequence, timing
from gnss_hil.tools.icd.documented_buses import Subject
from gnss_hil.tools.report.markup import Child, Markup, figure, own, tag, text

_CHAPTER = re.compile(r"^## (.+) \{#(.+)\}\n", re.MULTILINE)
_PLACE = re.compile(r"^\{\{(\w+)(?:: (.+))?\}\}$", re.MULTILINE)
_DIAGRAM = re.compile(r"^(?: {4}.*\n)+", re.MULTILINE)
_COMPUTED = "Frame budget"
"""Section of the contract's page that is computed for the scenario at hand instead."""


@dataclass(frozen=True, slots=True)
class Chapter:
    """Markdown with places: a line `{{part}}` or `{{part: argument}}` stands for one of PARTS."""

    title: str
    anchor: str
    words: str


@cache
def chapters() -> tuple[Chapter, ...]:
    page = own("icd", "document.md")
    _, *parts = _CHAPTER.split(page)
    return tuple(map(Chapter, parts[0::3], parts[1::3], parts[2::3]))


def section(title: str) -> Markup:
    """A section of the contract's page without its diagram, which is drawn as sequence charts here."""
    return prose.render(_DIAGRAM.sub("", prose.sections()[title]))


def _rest() -> Iterator[Markup]:
    """Sections of the contract's page that no chapter has named."""
    placed = {_COMPUTED} | {title for c in chapters() for part, title in _PLACE.findall(c.words)}
    for title in prose.sections():
        if title not in placed:
            yield tag.h3(title, id=prose.anchor(title))
            yield section(title)


def _epochs(subject: Subject) -> Iterator[Markup]:
    for bus in subject.buses:
        yield tag.h3(f"Craft {bus.craft}, vehicle {bus.vehicle}", id=f"budget-{bus.craft}")
        yield figure(
            timing.draw(bus.budget),
            "A steady epoch in which every channel tracks, with frames of typical length: above the epoch to "
            "scale, below its busy part. t is when the flight software begins to answer, its own affair.",
        )
        yield timing.budget_table(bus.budget)


def _sequences() -> Iterator[Markup]:
    for title, chart in sequence.charts().items():
        heading = tag.h3(title, id=f"sequence-{prose.anchor(title)}")
        yield tag.section(heading, sequence.draw(chart), class_="keep")


PARTS: dict[str, Callable[[Subject, str], Child]] = {
    "contract": lambda _, title: section(title),
    "rest": lambda *_: _rest(),
    "nodes": lambda subject, _: messages.node_table(subject.contract),
    "map": lambda subject, _: messages.overview(subject.contract),
    "messages": lambda subject, _: messages.groups(subject.contract),
    "values": lambda subject, _: messages.value_tables(subject.contract),
    "epochs": lambda subject, _: _epochs(subject),
    "advances": lambda subject, _: protection.advances(subject.contract.codec),
    "reasons": lambda *_: protection.reasons(),
    "examples": lambda subject, _: protection.worked_examples(subject.contract.codec),
    "sequences": lambda *_: _sequences(),
}
"""What may stand in a place."""


def render(chapter: Chapter, number: int, subject: Subject) -> Markup:
    words, *places = _PLACE.split(chapter.words)
    body: list[Child] = [prose.render(words)]
    for part, argument, following in zip(places[0::3], places[1::3], places[2::3], strict=True):
        body += [PARTS[part](subject, argument), prose.render(following)]
    heading = tag.h2(tag.span(number, class_="number"), " ", chapter.title, id=chapter.anchor)
    return tag.section(heading, text(body), class_="chapter")
