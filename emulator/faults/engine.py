"""Faults applied to the frames of a craft's bus, an epoch and a direction at a time: a pure function.

What is armed sees the frames in the order of the file, each what the one before has left. Triggers see them
untouched. A run without faults does not come here.

A call is an epoch's frames of one direction, all of them and once: draws are of the epoch, a satellite is
told by all frames of its channel, what is held back comes with a later call. Bench frames stay outside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.emulator.faults import place as places
from gnss_hil.emulator.faults import reach, when, where
from gnss_hil.emulator.faults.alter import Alter
from gnss_hil.emulator.faults.base import Actions, At, Direction, Now, Rows
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.kinds.row import Bus, Row
from gnss_hil.emulator.faults.models import Fault, FaultError
from gnss_hil.emulator.faults.triggers import Seen, Watch
from gnss_hil.emulator.faults.when import Window
from gnss_hil.emulator.faults.where import Where
from gnss_hil.emulator.numerics.keyed_draws import Stream, key_of


@dataclass(frozen=True, slots=True, eq=False)
class Armed:
    """A fault on a bus."""

    name: str
    kind: str
    place: str
    fault: Fault
    where: Where
    window: Window
    actions: Actions
    draws: Stream


@dataclass(frozen=True, slots=True, eq=False)
class FaultPlan:
    """The faults of one craft's bus, in order."""

    craft: str
    codec: Codec
    interval_ns: int
    armed: tuple[Armed, ...]
    watch: Watch


@dataclass(frozen=True, slots=True)
class Event:
    """A fault that acts on the frames of an epoch and direction.

    fault    its number in the plan;  since   first epoch of its window, or of the part of it
    touched  frames that it took out, put in or changed
    missing  how many frames fewer it left than there were
    clipped  how many of its values no bits could carry: the nearest that they can was sent
    """

    fault: int
    epoch: int
    t_ns: int
    direction: Direction
    since: int
    touched: int
    missing: int = 0
    clipped: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class FaultState:
    """All faults of a bus between epochs: states of their actions, how many frames each has struck, what
    triggers have seen."""

    actions: tuple[dict[Direction, Any], ...]
    struck: tuple[int, ...]
    seen: Seen


def armed(
    faults: Sequence[Fault], craft: str, vehicle: Vehicle, codec: Codec, interval_ns: int, seed: int,
    session: int = 0, link: str | None = None, origins: Sequence[str] = (), sky: Bool | None = None,
) -> FaultPlan:  # fmt: skip
    """Faults on a craft's bus; FaultError with every mistake: places, receivers, signals, links."""
    plan, wrong = arm(faults, craft, vehicle, codec, interval_ns, seed, session, link, origins, sky)
    if wrong:
        raise FaultError("\n".join(wrong))
    return plan


def arm(
    faults: Sequence[Fault], craft: str, vehicle: Vehicle, codec: Codec, interval_ns: int, seed: int,
    session: int = 0, link: str | None = None, origins: Sequence[str] = (), sky: Bool | None = None,
) -> tuple[FaultPlan, list[str]]:  # fmt: skip
    """Those of some faults that can be on a craft's bus, and a line for each mistake in the others.

    link      what they are to be done on, of `gnss_hil.emulator.faults.kinds.row.LINKS`; None: any
    origins   of each, for people
    sky       (SATELLITES,) satellites that there are; None: not known
    """
    bus = Bus(
        codec, vehicle.names, vehicle.clock_domain.tolist(), interval_ns, session, vehicle.channels.tolist(),
        sky,
    )  # fmt: skip
    found: list[Armed] = []
    wrong: list[str] = []
    strays = reach.no_strays()
    for number, fault in enumerate(faults):
        origin = origins[number] if origins else f"fault.{number}"
        try:
            if fault.craft in (None, craft):
                one = _armed(fault, number, craft, bus, seed, link, strays)
                strays = strays.and_of(KINDS[fault.kind], fault, one.where)
                found.append(one)
        except ValueError as error:
            wrong += [f"{origin}: {fault.kind}: {line}" for line in str(error).splitlines()]
    watch = Watch(codec, [one.window.after for one in found if one.window.after is not None], vehicle.names)
    return FaultPlan(craft, codec, interval_ns, tuple(found), watch), wrong


def _armed(
    fault: Fault, number: int, craft: str, bus: Bus, seed: int, link: str | None, strays: reach.Strays
) -> Armed:
    """ValueError with a line for each mistake."""
    row = KINDS[fault.kind]
    wrong: list[str] = []

    def done(what: Callable[[], Any]) -> Any:
        """What it returns; None, and the mistakes noted, if it raises."""
        try:
            return what()
        except ValueError as error:
            wrong.extend(str(error).splitlines())

    if link is not None and link not in row.links:
        others = f"; {' and '.join(row.links)} can" if row.links else ""
        wrong.append(f"{link} cannot do it: {row.why}{others}")
    window = done(lambda: when.window(fault.at, bus.interval_ns))
    done(lambda: reach.check_trigger(fault, bus))
    built = done(lambda: _built(row, fault, bus, link, strays))
    if wrong:
        raise ValueError("\n".join(wrong))
    return Armed(
        fault.name or f"{fault.kind} {number + 1}",
        fault.kind,
        places.text(fault.on),
        fault,
        built[0],
        window,
        built[1],
        Stream(seed, key_of(craft), f"fault {number}"),
    )


def _built(row: Row, fault: Fault, bus: Bus, link: str | None, strays: reach.Strays) -> tuple[Where, Actions]:
    """Place and actions of a fault."""
    place = reach.reached(row, fault, where.resolve(fault.on, bus.codec, bus.names), bus, link, strays)
    actions = row.build(fault, bus, place)
    reach.check_directions(row, fault, place, actions, bus.codec)
    return place, actions


def fresh(plan: FaultPlan) -> FaultState:
    """The state before the first epoch."""
    actions = tuple({way: action.fresh() for way, action in one.actions.items()} for one in plan.armed)
    return FaultState(actions, (0,) * len(plan.armed), Seen())


def inject(
    plan: FaultPlan, state: FaultState, frames: FrameBatch, at: At
) -> tuple[FaultState, FrameBatch, tuple[Event, ...]]:
    """An epoch's frames of one direction as the faults leave them; what acted."""
    seen = plan.watch.look(state.seen, frames, at.epoch, answer=at.direction is Direction.RECEIVERS)
    actions, struck = list(state.actions), list(state.struck)
    events: list[Event] = []
    for number, one in enumerate(plan.armed):
        action = one.actions.get(at.direction)
        if action is None:
            continue
        now = _now(plan, one, seen, at)
        if not now.active and action.sleeps(actions[number][at.direction]):
            continue
        placed = one.where.rows(frames)
        hit = _struck(one.window, placed, now, struck[number])
        before = len(frames)
        kept, frames, count = action.step(actions[number][at.direction], frames, Rows(placed, hit), now)
        actions[number] = {**actions[number], at.direction: kept}
        struck[number] += int(hit.sum())
        if now.active or count:
            missing = max(0, before - len(frames))
            clipped = action.clipped(kept) if isinstance(action, Alter) else 0
            events.append(Event(number, at.epoch, at.t_ns, at.direction, now.since, count, missing, clipped))
    return FaultState(tuple(actions), tuple(struck), seen), frames, tuple(events)


def _now(plan: FaultPlan, one: Armed, seen: Seen, at: At) -> Now:
    trigger = one.window.after
    origin = 0 if trigger is None else seen.since.get(trigger, -1)
    if trigger in seen.answered and not one.window.start and Direction.FLIGHT in one.actions:
        origin += 1  # the frames of its epoch have left
    since = one.window.begun(at.epoch, origin) if origin >= 0 else None
    return Now(plan.codec, at, since is not None, -1 if since is None else since, plan.interval_ns, one.draws)


def _struck(window: Window, placed: Bool, now: Now, before: int) -> Bool:
    """Which of the frames at the place are struck: in the window, by chance, as long as the number lasts."""
    if not now.active:
        return np.zeros(len(placed), bool)
    hit = placed
    if window.probability < 1:
        hit = hit & (now.uniform("probability", len(placed)) < window.probability)
    if window.count is not None:
        hit = hit & (np.cumsum(hit) <= window.count - before)
    return hit
