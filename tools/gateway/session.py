"""A gateway from the moment its buses are there to its end: what it says, what it writes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.process.bus_link import await_link
from gnss_hil.dbc.process.shutdown import Stop
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.engine import Event, FaultPlan
from gnss_hil.emulator.journal import FaultLog
from gnss_hil.tools.common.errors import Failed
from gnss_hil.tools.gateway.crossing import Crossing
from gnss_hil.tools.gateway.loop import BusGone, Passed, run_gateway
from gnss_hil.tools.gateway.strikes import Arm, Strikes
from gnss_hil.tools.recording.run_folder import FAULTS, RunFolder
from gnss_hil.tools.results import faults as ledger

OFF = 0.01
"""Epochs farther apart than --interval says, by this share of it, are another interval."""


@dataclass(frozen=True, slots=True)
class Gateway:
    """What is to be done.

    source  bus of the emulator;  sink  of the flight software
    arm     makes the faults of a session
    """

    source: str
    sink: str
    codec: Codec
    arm: Arm
    out: Path | None


def play(gateway: Gateway, say: Callable[[str], None]) -> int:
    """Passes frames until the run ends or a signal comes; the exit status. LinkError if there is no such bus,
    Failed if one goes away, or if epochs are not as far apart as the faults were told."""
    with ExitStack() as stack:
        stop = stack.enter_context(Stop())
        strikes = Strikes(gateway.arm)
        crossing = Crossing(gateway.codec, strikes)
        folder = None if gateway.out is None else RunFolder(gateway.out)
        links: dict[Direction, Link] = {}
        for way, spec in ((Direction.RECEIVERS, gateway.source), (Direction.FLIGHT, gateway.sink)):
            link = await_link(spec, stop, say)
            if link is None:
                return stop.status
            stack.callback(link.close)
            links[way] = link
        many = len(strikes.plan.armed)
        about = so_many(many, "fault") if many else "no faults"
        say(f"{gateway.source} <-> {gateway.sink}, {about}; Ctrl-C ends it")
        passed = _pass(gateway, links, crossing, strikes, folder, stop, say)
        say(f"{_how(crossing)}: {_count(passed)}; {strikes.touched} touched by faults{_lost(links)}")
        return 0 if crossing.ended else stop.status


def _pass(
    gateway: Gateway, links: Mapping[Direction, Link], crossing: Crossing, strikes: Strikes,
    folder: RunFolder | None, stop: Stop, say: Callable[[str], None],
) -> dict[Direction, Passed]:  # fmt: skip
    plans = [strikes.plan] if strikes.armed else []
    acting = Acting(strikes.plan, say)
    try:
        with FaultLog(None if folder is None else folder / FAULTS, plans) as log:

            def each(now_s: float) -> None:
                _check(crossing, strikes.plan.interval_ns)
                events = strikes.take()
                if events:
                    log.add([events], now_s)
                acting.look(events)

            passed = run_gateway(links, crossing, stop, each)
            acting.end()
            return passed
    except BusGone as error:
        bus = gateway.sink if error.toward is Direction.FLIGHT else gateway.source
        raise Failed(f"bus '{bus}' went away after {so_many(crossing.epochs, 'epoch')}") from None
    finally:
        if folder is not None:
            ledger.write(folder.path)


def _check(crossing: Crossing, interval_ns: int) -> None:
    """Windows count epochs by the interval: it has to be the run's."""
    found = crossing.interval_ns
    if found is not None and abs(found - interval_ns) > OFF * interval_ns:
        raise Failed(
            f"--interval {interval_ns / 1e9:g}: the marks on the bus are {found / 1e9:g} s apart; windows in "
            "seconds would be others"
        )


class Acting:
    """Says when faults begin to act, and when they are over."""

    def __init__(self, plan: FaultPlan, say: Callable[[str], None]):
        self._plan, self._say = plan, say
        self._since: dict[int, tuple[int, int, int]] = {}

    def look(self, events: tuple[Event, ...]) -> None:
        """Events of an epoch or part of one."""
        for event in events:
            if event.since < 0:
                continue
            if event.fault not in self._since:
                self._say(f"epoch {event.epoch}: {self._name(event.fault)} acts")
            _, touched, clipped = self._since.get(event.fault, (0, 0, 0))
            self._since[event.fault] = event.epoch, touched + event.touched, clipped + event.clipped
        newest = max((event.epoch for event in events), default=0)
        for fault, (last, *_) in [*self._since.items()]:
            if newest > last + 1:
                self._over(fault)

    def end(self) -> None:
        """The gateway ends."""
        for fault in [*self._since]:
            self._over(fault)

    def _over(self, fault: int) -> None:
        last, touched, clipped = self._since.pop(fault)
        many = so_many(touched, "frame")
        beyond = f"; {so_many(clipped, 'value')} led out of what the signal can carry" if clipped else ""
        self._say(f"epoch {last}: {self._name(fault)} acted for the last time, {many} touched{beyond}")

    def _name(self, fault: int) -> str:
        one = self._plan.armed[fault]
        return f"{one.name} ({one.place})"


def _how(crossing: Crossing) -> str:
    return f"{'the run ended' if crossing.ended else 'interrupted'} after {so_many(crossing.epochs, 'epoch')}"


def _count(passed: Mapping[Direction, Passed]) -> str:
    to_flight, back = passed[Direction.FLIGHT], passed[Direction.RECEIVERS]
    return (
        f"{so_many(to_flight.came, 'frame')} from the emulator, {to_flight.left} to the flight software; "
        f"{back.came} from it, {back.left} to the emulator"
    )


def _lost(links: Mapping[Direction, Link]) -> str:
    lost = sum(link.dropped for link in links.values())
    return f"; {lost} lost on the way here" if lost else ""
