"""The live view of a run on a terminal: a `Display` that counts every frame and draws four times a second."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.decoder.epoch_snapshot import EpochSnapshot, snapshot
from gnss_hil.tools.decoder.latest import Latest
from gnss_hil.tools.live.chart import History
from gnss_hil.tools.live.layout import screen
from gnss_hil.tools.live.live_error import LiveError
from gnss_hil.tools.live.live_faults import LiveFaults
from gnss_hil.tools.live.summary import CraftSummary, RunSummary
from gnss_hil.tools.live.terminal import Terminal
from gnss_hil.tools.recording.run_folder import FAULTS
from gnss_hil.tools.run_config.plan import Plan

DRAW_S = 0.25
PACE_WINDOW = 12
"""Draws over which the pace is taken: three seconds."""


class _Craft:
    """One craft: frames that wait to be looked at, and what was seen."""

    def __init__(self, name: str, vehicle: Vehicle, codec: Codec, live_error: LiveError, interval_ns: int):
        self._name, self._vehicle = name, vehicle
        self._live_error, self._interval_ns = live_error, interval_ns
        self._bus = Latest(codec, interval_ns / 1e9)
        self._epochs: list[int] = []
        self._blocks: list[FrameBatch] = []
        self._snapshot: EpochSnapshot | None = None
        self._history = History()
        self.hear = self._epochs.append, self._blocks.append

    def look(self) -> CraftSummary | None:
        """All that came since the last look; None before the first epoch."""
        if self._epochs:
            last = self._bus.take(self._epochs, self._blocks)
            self._snapshot = snapshot(last, self._epochs[-1], self._vehicle.boresight_body)
            self._live_error.look(self._snapshot, self._interval_ns)
            fix = self._snapshot.fix
            satellites = None if fix is None or fix.mode == "NO_FIX" else fix.satellites
            t_s = self._snapshot.epoch * self._interval_ns / 1e9
            self._history.add(t_s, self._live_error.error_m, satellites)
            self._epochs.clear()
            self._blocks.clear()
        if self._snapshot is None:
            return None
        return CraftSummary(
            self._name,
            self._vehicle,
            self._bus,
            self._snapshot,
            self._interval_ns / 1e9,
            self._live_error.error_m,
            self._history,
        )


class LiveView:
    """Draws on the alternate screen once the first epoch is heard; notes are written again at the end."""

    def __init__(self, plan: Plan, truth: Path, terminal: Terminal):
        self._plan, self._terminal = plan, terminal
        time_ = plan.scenario.time
        self._interval_s = time_.epoch_interval_s
        parts = zip(plan.names, plan.vehicles, plan.codecs, strict=True)
        self._craft = [
            _Craft(name, vehicle, codec, LiveError(truth, i, len(plan.names)), time_.interval_ns)
            for i, (name, vehicle, codec) in enumerate(parts)
        ]
        self._faults = LiveFaults(truth.with_name(FAULTS), plan.world.faults)
        self._begun = False
        self._next = 0.0
        self._notes: list[str] = []
        self._paces: deque[tuple[float, int]] = deque(maxlen=PACE_WINDOW)

    def hear(self, craft: int, epoch: int, frames: FrameBatch) -> None:
        keep_epoch, keep_frames = self._craft[craft].hear
        keep_epoch(epoch)
        keep_frames(frames)
        self._begun = True

    def refresh(self, unanswered: int = 0) -> None:
        now = time.monotonic()
        if self._begun and now >= self._next:
            self._next = now + DRAW_S
            craft = [seen for one in self._craft if (seen := one.look()) is not None]
            if self._terminal.ready and len(craft) == len(self._craft):
                self._draw(now, unanswered, craft)

    def _draw(self, now: float, unanswered: int, craft: Sequence[CraftSummary]) -> None:
        epoch = craft[0].snapshot.epoch
        self._paces.append((now, epoch))
        then, before = self._paces[0]
        run = RunSummary(
            scenario=self._plan.scenario.name,
            epoch=epoch,
            simulated_s=(epoch + 1) * self._interval_s,
            duration_s=self._plan.scenario.time.duration_s,
            pace=(epoch - before) * self._interval_s / (now - then) if now - then > 1.0 else None,
            unanswered=unanswered,
            craft=tuple(craft),
            notes=tuple(self._notes),
            faults=self._faults.look(),
        )
        self._terminal.draw(screen(run, *self._terminal.size))

    def note(self, text: str) -> None:
        if self._begun:
            self._notes.append(text)
        else:
            self._terminal.say(text)

    def close(self) -> None:
        self._terminal.leave()
        self._faults.close()
        while self._notes:
            self._terminal.say(self._notes.pop(0))
