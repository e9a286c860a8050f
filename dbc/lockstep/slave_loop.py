"""The slave loop: a flight node announces itself, answers the time master, resumes when it went away."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.lockstep.slave_protocol import Slave, Task, Work

HEARTBEAT_S = 0.1
SILENCE_S = 5.0
"""Without a frame for so long the node takes the time master for gone and announces itself again."""


@dataclass(slots=True)
class SlaveProgress:
    """Epochs answered and runs ended so far."""

    epochs: int = 0
    runs_ended: int = 0


def run_slave(
    link: Link,
    slave: Slave,
    heartbeat: FrameBatch,
    play: Callable[[FrameBatch, bool], FrameBatch],
    stop: Callable[[], bool] = lambda: False,
    once: bool = False,
    silence_s: float = SILENCE_S,
) -> SlaveProgress:
    """Plays epochs until `stop()`; with `once`, until the first run's end.

    play  block heard, whether to start from a fresh state -> block to send
    """
    progress = SlaveProgress()
    heard_s = time.monotonic() - silence_s  # a node that comes to a bus, or back to one, announces itself
    announced_s = -HEARTBEAT_S
    while not stop() and not (once and progress.runs_ended):
        now_s = time.monotonic()
        if (not slave.running or now_s - heard_s >= silence_s) and now_s - announced_s >= HEARTBEAT_S:
            link.send(heartbeat)
            announced_s = now_s
        frames = link.receive(_patience_s(slave, now_s))
        now_s = time.monotonic()
        if len(frames):
            heard_s = now_s
        for work in slave.hear(frames, now_s):
            _do(work, link, slave, play, progress)
        for work in slave.expire(now_s):
            _do(work, link, slave, play, progress)
    return progress


def _patience_s(slave: Slave, now_s: float) -> float:
    due_s = slave.due_s()
    return HEARTBEAT_S if due_s is None else min(HEARTBEAT_S, max(0.0, due_s - now_s))


def _do(work: Work, link: Link, slave: Slave, play, progress: SlaveProgress) -> None:
    if work.task is Task.STEP:
        link.send(slave.answer(play(work.block, work.fresh)))
        progress.epochs += 1
    elif work.task is Task.REPEAT:
        link.send(work.block)
    else:
        progress.runs_ended += 1
