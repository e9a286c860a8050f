"""The chapters of the document: words of the contract's page, and around them what is drawn and computed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from gnss_hil.dbc.contract.e2e import Verdict
from gnss_hil.flightsw.io.frame_statistics import CONSEQUENCE, Reason
from gnss_hil.tools.icd import charts, messages, prose, protection, sequence, timing
from gnss_hil.tools.icd.contract import Contract
from gnss_hil.tools.icd.markup import Child, Markup, figure, table, tag, text
from gnss_hil.tools.run_config.frame_budget import Budget


@dataclass(frozen=True, slots=True)
class Bus:
    """A spacecraft's bus in the scenario of which the budget is told."""

    craft: str
    vehicle: str
    budget: Budget


@dataclass(frozen=True, slots=True)
class Subject:
    """What the document is of."""

    contract: Contract
    scenario: str
    buses: tuple[Bus, ...]


@dataclass(frozen=True, slots=True)
class Chapter:
    title: str
    anchor: str
    body: Callable[[Subject], Child]


_CONVENTIONS = ("Time", "Measurements", "Attitude", "Almanac", "Commands", "Navigation")

_NOTHING: prose.Block = lambda _: Markup("")  # noqa: E731 - drawn instead


def section(title: str, block: prose.Block = prose.code, heading: str = "") -> Markup:
    """A section of the contract's page under its own heading."""
    body = prose.render(prose.sections()[title], block)
    return tag.section(tag.h3(heading or title, id=prose.anchor(title)), body)


def _scope(subject: Subject) -> Iterator[Markup]:
    yield prose.paragraph("""
        This document says what passes on the CAN bus between the navigation receivers, the attitude unit
        and the time source of a spacecraft on the one side, played by the emulator, and its flight software
        on the other. Either side can be replaced by one that keeps to it. Messages and bits are those of the
        DBC file with the contract hash on the cover, which is the authority. The words *must* and *may* are
        meant.
    """)
    yield prose.paragraph("""
        A kind of message that repeats is named after its sender in the DBC: the kind `RANGE` is `RX1_RANGE`,
        `RX2_RANGE` and so on; `HEARTBEAT` is `RX1_HEARTBEAT`, `ATT_HEARTBEAT` and so on.
    """)


def _bus(subject: Subject) -> Iterator[Markup]:
    yield section("Bus", heading="Physical layer")
    yield section("Nodes")
    yield tag.h4("Nodes of this contract")
    yield messages.node_table(subject.contract)


def _conventions(subject: Subject) -> Iterator[Markup]:
    yield from map(section, _CONVENTIONS)


def _timing(subject: Subject) -> Iterator[Markup]:
    for bus in subject.buses:
        yield tag.h3(f"Craft {bus.craft}, vehicle {bus.vehicle}", id=f"budget-{bus.craft}")
        yield figure(
            timing.draw(bus.budget),
            "A steady epoch in which every channel tracks, with frames of typical length: above the epoch to "
            "scale, below its busy part. t is when the flight software begins to answer, its own affair.",
        )
        yield timing.budget_table(bus.budget)


def _protection(subject: Subject) -> Iterator[Markup]:
    codec = subject.contract.codec
    yield section("Protection", heading="Rules")
    yield tag.h3("States of a stream", id="states")
    yield prose.paragraph("""
        By how much the counter is on from the last frame of the stream whose CRC was right, modulo 15. The
        first frame of a stream is in order whatever its counter.
    """)
    yield protection.advances(codec)
    yield tag.h3("Reasons and consequences", id="reasons")
    yield prose.paragraph("""
        Checked in this order: form (error frame, extended, remote, length, identifier), CRC and counter 15,
        counter, contract of the node, epoch, completeness. The reasons are those under which our flight
        software counts frames; nothing that a bus may carry ends it.
    """)
    yield _refused()
    yield tag.h3("Worked examples", id="examples")
    yield prose.paragraph("""
        Each is the first frame of its stream. Start value and final XOR of the CRC are zero; T is the table
        below, the CRC of each byte with polynomial 0x1D.
    """)
    yield protection.worked_examples(codec)
    yield protection.later_frames(codec)
    yield tag.section(tag.h4("T: CRC-8 of each byte"), protection.crc_table(), class_="keep")


_ORDER_OF_CHECKS = (
    Verdict.ERROR_FRAME, Verdict.EXTENDED, Verdict.REMOTE, Verdict.WRONG_LENGTH, Verdict.UNKNOWN_ID,
    Verdict.CORRUPTED, Verdict.REPEATED, Verdict.WRONG_SEQUENCE, Verdict.LOST,
    Reason.OTHER_CONTRACT, Reason.OTHER_SESSION, Reason.BAD_TIME_MARK, Reason.NO_TIME_MARK,
    Verdict.MIXED_EPOCH, Reason.SURPLUS, Reason.INCOMPLETE, Reason.TIMED_OUT,
)  # fmt: skip


def _refused() -> Markup:
    rows = ((protection.spoken(reason.name), CONSEQUENCE[reason]) for reason in _ORDER_OF_CHECKS)
    return table(("reason", "consequence"), rows, class_="reasons")


def _lockstep(subject: Subject) -> Iterator[Markup]:
    yield section("Bench frames: lockstep", _NOTHING, heading="Rules")
    for chart in charts.CHARTS:
        yield tag.section(
            tag.h3(chart.title, id=f"sequence-{prose.anchor(chart.title)}"),
            figure(sequence.draw(chart), chart.caption), class_="keep",
        )  # fmt: skip


_ELSEWHERE = frozenset(
    {*_CONVENTIONS, "Bus", "Nodes", "Protection", "Bench frames: lockstep", "Frame budget"}
)
"""Sections that have their place; the frame budget is computed for the scenario at hand."""


def _starting(subject: Subject) -> Iterator[Markup]:
    """Whatever else the contract's page says."""
    yield from (section(title) for title in prose.sections() if title not in _ELSEWHERE)


CHAPTERS = (
    Chapter("Scope", "scope", _scope),
    Chapter("Bus and nodes", "bus-and-nodes", _bus),
    Chapter("Conventions", "conventions", _conventions),
    Chapter("Message map", "map", lambda subject: messages.map_chapter(subject.contract)),
    Chapter("Messages", "messages", lambda subject: messages.messages_chapter(subject.contract)),
    Chapter("Value tables", "values", lambda subject: messages.value_tables(subject.contract)),
    Chapter("An epoch on the bus", "epoch", _timing),
    Chapter("Protection of frames", "end-to-end", _protection),
    Chapter("Sequences and lockstep", "sequences", _lockstep),
    Chapter("Putting software on the bus", "starting", _starting),
)


def render(chapter: Chapter, number: int, subject: Subject) -> Markup:
    heading = tag.h2(tag.span(number, class_="number"), " ", chapter.title, id=chapter.anchor)
    return tag.section(heading, text(chapter.body(subject)), class_="chapter")
