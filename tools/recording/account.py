"""Whether the record of a bus is the flight: what was counted on both sides of it, compared.

What the record lacks, or has of somebody else, is a fault of the run. What was refused and changed nothing is
told, and takes from the run that it is reproducible.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import Refusal


@dataclass(frozen=True, slots=True)
class Heard:
    """What the recorder counted on one craft's bus.

    epochs       on record;  answers  of them that the flight software closed with DONE
    miscounts    answers that say another number of frames than came;  miscount  the first: epoch, said, came
    refused      bench frames, by reason;  refused_in  the same by epoch
    refused_marks   intact time marks that opened no epoch
    late         answers two epochs late or more;  lost_answers  of those, so late that they are not on record
    several      nodes for which more than one peer spoke;  contested  by turns
    ended        BENCH_END was heard: both sides stop where the record does
    """

    epochs: int
    answers: int
    refused: Mapping[Refusal, int] = field(default_factory=dict)
    refused_marks: int = 0
    late: int = 0
    lost_answers: int = 0
    several: tuple[str, ...] = ()
    contested: tuple[str, ...] = ()
    ended: bool = True
    miscounts: int = 0
    miscount: tuple[int, int, int] = (0, 0, 0)
    refused_in: Mapping[int, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Counted:
    """What the sides of a run counted themselves, None where they do not tell.

    epochs  the time master played;  fixes  the flight software of the craft flew
    """

    epochs: int | None = None
    fixes: int | None = None


@dataclass(frozen=True, slots=True)
class Decoded:
    """What is decoded from the record of a craft: answers that say how they went, valid fixes, and frames
    that do not follow the one before them in their stream."""

    answers: int
    fixes: int
    out_of_order: int = 0


Told = tuple[str, Heard, Counted, Decoded]
"""All that is known of a craft's record."""


def faults(
    craft: str, heard: Heard, counted: Counted, decoded: Decoded, disturbed: bool = False
) -> Iterator[str]:
    """Why the record is not the flight, a line each.

    disturbed   faults were armed on the bus: what nodes say and leave unsaid may be their work, and is noted
    """
    if counted.epochs not in (None, heard.epochs):
        yield f"{craft}: {so_many(heard.epochs, 'epoch')} on record, the time master played {counted.epochs}"
    if not disturbed:
        yield from _conduct(craft, heard, counted, decoded)
    if heard.lost_answers:
        yield (
            f"{craft}: {so_many(heard.lost_answers, 'answer')} came so late that frames could not tell their "
            "epoch, and are not on record"
        )
    if heard.ended and counted.fixes not in (None, decoded.fixes):
        yield f"{craft}: fixes: {decoded.fixes} on record, {counted.fixes} flown"


def _conduct(craft: str, heard: Heard, counted: Counted, decoded: Decoded) -> Iterator[str]:
    """What the nodes of a bus do wrong, or leave undone."""
    if heard.epochs and not decoded.answers:
        yield f"{craft}: the flight software answered none of {so_many(heard.epochs, 'epoch')}"
    if heard.miscounts:
        epoch, said, came = heard.miscount
        more = f", the first of {heard.miscounts}" if heard.miscounts > 1 else ""
        yield (
            f"{craft}: BENCH_DONE of epoch {epoch} says {so_many(said, 'frame')}, {came} came before it{more}"
            ": it counts wrong, or frames were lost"
        )
    if heard.contested:
        nodes = ", ".join(heard.contested)
        yield f"{craft}: several peers of the bus spoke by turns for {nodes}: the record may be of either"
    elif heard.several and decoded.out_of_order and counted.fixes is None:
        nodes, many = ", ".join(heard.several), so_many(decoded.out_of_order, "frame")
        yield f"{craft}: several peers of the bus spoke for {nodes}, and {many} on record are out of order"
    if decoded.answers < heard.answers - heard.lost_answers:
        yield (
            f"{craft}: the flight software answered {so_many(heard.answers - heard.lost_answers, 'epoch')}, "
            f"{decoded.answers} NAV_STATUS are on record"
        )


def notes(
    craft: str, heard: Heard, counted: Counted, decoded: Decoded, disturbed: bool = False
) -> Iterator[str]:
    """What was refused or late and changed nothing, a line each; and what faults may have brought about."""
    if disturbed:
        yield from _conduct(craft, heard, counted, decoded)
    if not heard.ended and counted.fixes not in (None, decoded.fixes):
        yield f"{craft}: fixes: {decoded.fixes} on record, which nobody ended; {counted.fixes} flown"
    if refused := messages.explain(heard.refused):
        yield f"{craft}: {refused}"
    if heard.refused_marks:
        many = so_many(heard.refused_marks, "time mark")
        yield f"{craft}: {many} left out of the record: no epoch followed"
    if heard.late:
        yield f"{craft}: {so_many(heard.late, 'answer')} two epochs late or more"
    if restarted := sorted({*heard.several} - {*heard.contested}):
        yield f"{craft}: more than one peer of the bus spoke for {', '.join(restarted)}, one after the other"


def reproducible(heard: Heard) -> bool:
    """Whether nothing on the bus but the run itself had a part in the record."""
    return not (heard.refused or heard.refused_marks or heard.late or heard.several)
