"""What faults did: events of epochs, as lines of a file, and as rows of `faults.parquet`.

A row is a stretch of a fault on one bus and in one direction: a window, or a part of it, in whose every epoch
frames were struck or could have been. What a fault still does behind its window (counters that go on from
elsewhere, a receiver that acquires) is a row of its own that is not active.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.engine import Event, FaultPlan


@dataclass(frozen=True, slots=True)
class Stretch:
    """A fault from one epoch to another.

    active    within its window
    epochs    in which it acted;  touched  frames that it took out, put in or changed
    missing   how many frames fewer it left than there were, over its epochs
    clipped   how many of its values no bits could carry: the nearest that they can was sent
    struck    first epoch in which it touched a frame; -1 if it touched none
    """

    craft: int
    fault: int
    direction: Direction
    active: bool
    first: int
    last: int
    epochs: int
    touched: int
    missing: int = 0
    struck: int = -1
    clipped: int = 0


def stretches(events: Iterable[tuple[int, Event]]) -> list[Stretch]:
    """Stretches of events (number of the craft, event) in the order of their epochs; by first epoch."""
    done: list[Stretch] = []
    open_: dict[tuple[int, int, Direction], tuple[int, Stretch]] = {}
    for craft, event in events:
        key = craft, event.fault, event.direction
        struck = event.epoch if event.touched else -1
        since, stretch = open_.get(key, (event.since, None))
        if stretch is not None and since == event.since and event.epoch - stretch.last <= 1:
            grown = replace(
                stretch, last=event.epoch, epochs=stretch.epochs + (event.epoch != stretch.last),
                touched=stretch.touched + event.touched, missing=stretch.missing + event.missing,
                struck=stretch.struck if stretch.struck >= 0 else struck,
                clipped=stretch.clipped + event.clipped,
            )  # fmt: skip
        else:
            done += [stretch] if stretch is not None else []
            grown = Stretch(
                craft,
                event.fault,
                event.direction,
                event.since >= 0,
                event.epoch,
                event.epoch,
                1,
                event.touched,
                event.missing,
                struck,
                event.clipped,
            )
        open_[key] = event.since, grown
    done += [stretch for _, stretch in open_.values()]
    return sorted(done, key=lambda one: (one.first, one.craft, one.fault, one.direction.value))


def header(plans: Sequence[FaultPlan]) -> str:
    """First line of the file: what is armed on each craft's bus."""
    return json.dumps({"armed": [about(plan) for plan in plans]}) + "\n"


def about(plan: FaultPlan) -> dict[str, Any]:
    """What is armed on a bus."""
    return {
        "craft": plan.craft,
        "faults": [{"name": one.name, "kind": one.kind, "place": one.place} for one in plan.armed],
    }


def acting(plans: Sequence[FaultPlan], events: Sequence[Sequence[Event]]) -> list[str]:
    """Names of the faults that act within their windows, of the events of an epoch by craft; each once."""
    found = (
        plan.armed[event.fault].name
        for plan, some in zip(plans, events, strict=True)
        for event in some
        if event.since >= 0
    )
    return list(dict.fromkeys(found))


def line(craft: int, event: Event) -> str:
    """An event as a line."""
    fields = (event.fault, event.epoch, event.t_ns, event.direction.value, event.since, event.touched)
    return json.dumps([craft, *fields, event.missing, event.clipped], separators=(",", ":")) + "\n"


def read(lines: Iterable[str]) -> tuple[list[dict[str, Any]], Iterator[tuple[int, Event]]]:
    """What was armed by craft, and events (number of the craft, event); a last line that is cut short is left
    out."""
    lines = iter(lines)
    return json.loads(next(lines))["armed"], events(lines)


def events(lines: Iterable[str]) -> Iterator[tuple[int, Event]]:
    """Events (number of the craft, event) of lines behind the first."""
    for text in lines:
        if not text.endswith("\n"):
            return
        craft, fault, epoch, t_ns, way, *counts = json.loads(text)
        yield craft, Event(fault, epoch, t_ns, Direction(way), *counts)
