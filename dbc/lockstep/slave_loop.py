"""A flight node at work: announces itself, follows the time master, resumes when it went away."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.lockstep.slave import Follower, Task, Work

HEARTBEAT_S = 0.1
SILENCE_S = 5.0
"""Without a frame for so long the node takes the time master for gone and announces itself again."""


@dataclass(slots=True)
class Journey:
    """What a node lived through so far."""

    epochs: int = 0
    runs_ended: int = 0


def follow(
    link: Link,
    follower: Follower,
    heartbeat: FrameBatch,
    play: Callable[[FrameBatch, bool], FrameBatch],
    stop: Callable[[], bool] = lambda: False,
    once: bool = False,
    silence_s: float = SILENCE_S,
) -> Journey:
    """Plays epochs until `stop()`; with `once`, until the first run's end.

    play  block heard, whether to start from a fresh state -> block to send
    """
    journey = Journey()
    heard_s = time.monotonic() - silence_s  # whoever comes to a bus, or back to one, announces itself
    announced_s = -HEARTBEAT_S
    while not stop() and not (once and journey.runs_ended):
        now_s = time.monotonic()
        if (not follower.running or now_s - heard_s >= silence_s) and now_s - announced_s >= HEARTBEAT_S:
            link.send(heartbeat)
            announced_s = now_s
        frames = link.receive(_patience_s(follower, now_s))
        now_s = time.monotonic()
        if len(frames):
            heard_s = now_s
        for work in follower.hear(frames, now_s):
            _do(work, link, follower, play, journey)
        for work in follower.expire(now_s):
            _do(work, link, follower, play, journey)
    return journey


def _patience_s(follower: Follower, now_s: float) -> float:
    due_s = follower.due_s()
    return HEARTBEAT_S if due_s is None else min(HEARTBEAT_S, max(0.0, due_s - now_s))


def _do(work: Work, link: Link, follower: Follower, play, journey: Journey) -> None:
    if work.task is Task.STEP:
        link.send(follower.answer(play(work.block, work.fresh)))
        journey.epochs += 1
    elif work.task is Task.REPEAT:
        link.send(work.block)
    else:
        journey.runs_ended += 1
