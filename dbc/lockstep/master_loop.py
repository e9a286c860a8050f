"""The time master at work: barrier, epochs and end over one link for each craft, by wall time."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.latency import Latency
from gnss_hil.dbc.lockstep.master_protocol import Barrier, Exchange

SLICE_S = 0.1
"""Longest wait at a stretch, so that a signal is noticed."""


GREETINGS, GREETINGS_APART_S = 4, 0.05
"""A node that announces itself so often, at least so far apart, instead of answering has started anew: it did
not hear the block and never will. Those that it sent before it heard the block come all at once, or fewer."""

WORK_REMEMBERED, WORK_MARGIN = 16, 1.5
"""At a pace the next block is begun before its instant: by the longest that one of the last blocks took, and
half as long again."""


WAITING_TOLD_S = 2.0
"""Who waits at the barrier so long says for whom; what is wrong with a heartbeat is said when it is heard."""


class MissingNodes(Exception):
    """The barrier's limit passed, or what was heard will not do; the message says who is missing, or why."""


class Unanswered(Exception):
    """A node has not answered for too long; the message says which and how long."""


@dataclass(frozen=True, slots=True)
class Bus:
    """One craft's bus as the time master sees it; `spec` is what it is called on a command line."""

    link: Link
    codec: Codec
    spec: str = ""


@dataclass(slots=True)
class Tally:
    """What the master counted.

    latency  wall time from the end of the emulator's block to the last DONE
    late_s   at a pace: how long after its instant an epoch began, at most
    """

    sent: int = 0
    received: int = 0
    unanswered: int = 0
    late_s: float = 0.0
    latency: Latency = field(default_factory=Latency)


def parse_pace(text: str) -> float | None:
    """Simulated seconds per wall second, None for lockstep; ValueError says what is allowed."""
    if text == "lockstep":
        return None
    if text == "realtime":
        return 1.0
    try:
        factor = float(text.removeprefix("x")) if text.startswith("x") else 0.0
    except ValueError:
        factor = 0.0
    if not 1e-3 <= factor <= 1e6:
        raise ValueError(f"pace '{text}': not one of lockstep, realtime, xN (x0.001 to x1000000)")
    return factor


class MasterLoop:
    """Plays epochs on all buses in one of the paces.

    pace        simulated per wall seconds, None for lockstep
    interval_s  simulated time between epochs
    limit_s     lockstep: wall time after which an epoch goes on unanswered
    repeat_s    lockstep: silence after which SYNC is repeated
    most_unanswered   epochs in a row without an answer after which `play` raises Unanswered; None: never. At
                a pace that is of a node that has answered before, and that many times `limit_s` of wall time
    stop        asked between waits; True ends them early
    """

    def __init__(
        self,
        buses: Mapping[str, Bus],
        session: int,
        pace: float | None,
        interval_s: float,
        limit_s: float = 10.0,
        repeat_s: float = 1.0,
        most_unanswered: int | None = None,
        stop: Callable[[], bool] = lambda: False,
    ):
        self.tally = Tally()
        self._buses = dict(buses)
        self._session = session
        self._period_s = None if pace is None else interval_s / pace
        self._limit_s, self._repeat_s = limit_s, repeat_s
        self._most_unanswered = most_unanswered
        self._in_a_row = 0
        self._answered_s = math.nan
        self._stop = stop
        self._exchanges = {name: self._exchange(bus, {}) for name, bus in self._buses.items()}
        self._start_s = -math.inf
        self._work_s: deque[float] = deque(maxlen=WORK_REMEMBERED)
        self._handed_s = math.nan

    @property
    def paced(self) -> bool:
        """Whether epochs begin at instants of wall time."""
        return self._period_s is not None

    @property
    def lost(self) -> int:
        """Frames known to be lost on the way to the master."""
        announced = sum(exchange.lost for exchange in self._exchanges.values())
        return announced + sum(bus.link.dropped for bus in self._buses.values())

    @property
    def late(self) -> int:
        """Answers that came when their epoch was over."""
        return sum(exchange.late for exchange in self._exchanges.values())

    def assemble(
        self,
        required: Sequence[int] = (FLIGHT_NODE,),
        timeout_s: float | None = None,
        tell: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Waits until all required nodes were heard on every bus.

        tell  is handed what is wrong with a heartbeat when it is heard, and for whom it waits after a while
        MissingNodes after `timeout_s`, and at once where a node speaks another contract and a limit was set.
        """
        begun_s = time.monotonic()
        for name, bus in self._buses.items():
            barrier, told = Barrier(bus.codec, required), ""
            while barrier.missing and not self._stop():
                waited_s = time.monotonic() - begun_s
                wrong = barrier.wrong()
                if timeout_s is not None and (waited_s >= timeout_s or barrier.foreign):
                    absent = (
                        f"{barrier.explain()} within {timeout_s:g} s: {barrier.awaited()} is not running, or "
                        f"not on {bus.spec or 'this bus'}"
                    )
                    raise MissingNodes(f"craft {name}: {wrong or absent}")
                absent = f"{barrier.explain()} so far; is it running, and on this bus?"
                text = wrong or (absent if waited_s >= WAITING_TOLD_S else "")
                if text and text != told:
                    told = text
                    where = f" on {bus.spec}" if bus.spec else ""
                    tell(f"waiting for {barrier.awaited()} of {name}{where}: {text}")
                barrier.hear(bus.link.receive(SLICE_S))
            self._exchanges[name] = self._exchange(bus, barrier.greetings)

    def play(
        self, epoch: int, blocks: Mapping[str, FrameBatch], meanwhile: Callable[[], None] = lambda: None
    ) -> dict[str, FrameBatch]:
        """Sends an epoch's blocks and returns what the nodes answered, the emulator's next inbox.

        meanwhile  at a pace: work for later epochs, done while there is nothing else to do
        """
        if self._period_s is not None:
            self._work_s.append(time.monotonic() - self._handed_s)
            self._await_instant(epoch, self._period_s)
        for name, bus in self._buses.items():
            bus.link.send(self._exchanges[name].open(epoch, blocks[name]))
            self.tally.sent += messages.counted(blocks[name])
        sent_s = time.perf_counter()
        if self._period_s is None:
            inbox = self._gather(sent_s)
        else:
            inbox = self._listen(self._begin_s(epoch + 1, self._period_s), sent_s, meanwhile)
            self._handed_s = time.monotonic()
        self.tally.received += sum(len(frames) for frames in inbox.values())
        self._give_up(epoch)
        return inbox

    def end(self, epochs: int, reason: str) -> None:
        """Tells the nodes that the run is over."""
        for name, bus in self._buses.items():
            bus.link.send(self._exchanges[name].end(epochs, reason))

    def _exchange(self, bus: Bus, greetings: Mapping[int, bytes]) -> Exchange:
        return Exchange(bus.codec, self._session, greetings, keep_late=self._period_s is not None)

    def _gather(self, sent_s: float) -> dict[str, FrameBatch]:
        """Lockstep: waits for every node's answer."""
        answered = True
        for name, bus in self._buses.items():
            answered &= self._await_answer(bus.link, self._exchanges[name], sent_s)
        self._count(answered, time.perf_counter() - sent_s)
        return {name: exchange.inbox() for name, exchange in self._exchanges.items()}

    def _await_answer(self, link: Link, exchange: Exchange, sent_s: float) -> bool:
        end_s = sent_s + self._limit_s
        repeat_s = sent_s + self._repeat_s
        wait_s = min(SLICE_S, self._limit_s)
        greetings, greeted_s = 0, sent_s
        while not exchange.hear(frames := link.receive(wait_s)):
            now_s = time.perf_counter()
            if exchange.greeted(frames) and now_s >= greeted_s + GREETINGS_APART_S:
                greetings, greeted_s = greetings + 1, now_s
            if self._stop() or now_s >= end_s or greetings == GREETINGS:
                return False
            if now_s >= repeat_s:
                link.send(exchange.repeat())
                repeat_s = now_s + self._repeat_s
            wait_s = min(SLICE_S, end_s - now_s, repeat_s - now_s)
        return True

    def _begin_s(self, epoch: int, period_s: float) -> float:
        """When work on an epoch's block must begin; half of the time that is left is for listening."""
        known = [work_s for work_s in self._work_s if not math.isnan(work_s)]
        now_s, instant_s = time.monotonic(), self._start_s + epoch * period_s
        return max(instant_s - WORK_MARGIN * max(known, default=0.0), (now_s + instant_s) / 2)

    def _listen(self, until_s: float, sent_s: float, meanwhile: Callable[[], None]) -> dict[str, FrameBatch]:
        """At a pace: hears what arrives until the next block must be begun. Work for later is done once all
        have answered, or in the second half."""
        answered = worked = False
        half_s = (time.monotonic() + until_s) / 2
        while not self._stop():
            now_s = time.monotonic()
            self._hear_all(min(max((until_s if worked else half_s) - now_s, 0.0), SLICE_S))
            if not answered and all(exchange.answered for exchange in self._exchanges.values()):
                answered = True
                self._count(True, time.perf_counter() - sent_s)
            if not worked and (answered or now_s >= half_s):
                worked = True
                meanwhile()
            if now_s >= until_s:
                break
        if not answered:
            self._count(False, 0.0)
        return {name: exchange.everything() for name, exchange in self._exchanges.items()}

    def _hear_all(self, wait_s: float) -> None:
        """Takes what arrived on every bus, waiting `wait_s` in all."""
        for name, bus in self._buses.items():
            self._exchanges[name].hear(bus.link.receive(wait_s / len(self._buses)))

    def _await_instant(self, epoch: int, period_s: float) -> None:
        """Epoch 0 sets the start; a master that fell behind does not hurry to catch up."""
        now_s = time.monotonic()
        late_s = now_s - (self._start_s + epoch * period_s)
        if math.isfinite(late_s):
            self.tally.late_s = max(self.tally.late_s, late_s)
        if late_s > period_s:
            self._start_s = now_s - epoch * period_s
        while (rest_s := self._start_s + epoch * period_s - time.monotonic()) > 0 and not self._stop():
            time.sleep(min(rest_s, SLICE_S))

    def _count(self, answered: bool, latency_s: float) -> None:
        if answered:
            self.tally.latency.add(latency_s)
        elif not self._stop():
            self.tally.unanswered += 1
        self._in_a_row = 0 if answered or self._stop() else self._in_a_row + 1
        now_s = time.monotonic()
        self._answered_s = now_s if answered else self._answered_s

    def _give_up(self, epoch: int) -> None:
        """Unanswered, if nobody has answered for too long."""
        most = self._most_unanswered
        if most is None or self._stop() or self._in_a_row < most:
            return
        silent = ", ".join(name for name, exchange in self._exchanges.items() if not exchange.answered)
        since = f"FLIGHT of {silent} has not answered"
        row = f"{so_many(self._in_a_row, 'epoch')} in a row, to epoch {epoch}"
        if self._period_s is None:
            raise Unanswered(f"{since} for {row}, each waited for {self._limit_s:g} s: the run ends")
        silent_s = (
            time.monotonic() - self._answered_s
        )  # nan: never answered, a node that knows no bench frames
        if silent_s >= most * self._limit_s:
            raise Unanswered(f"{since} for {silent_s:.0f} s, {row}: the run ends")
