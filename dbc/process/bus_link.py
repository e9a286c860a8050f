"""How the process shells come onto their bus: they wait for one that is not there yet, or that went away."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from gnss_hil.dbc.bus.base import Link, LinkError, NotYet
from gnss_hil.dbc.bus.open_link import open_link

RETRY_S = 0.2
"""How often a bus that is not there is looked for."""


def await_link(
    spec: str, stop: Callable[[], bool], say: Callable[[str], None], wait_s: float | None = None
) -> Link | None:
    """A link on a bus; waits for a bench of ours that does not run yet. None if `stop` came first.

    wait_s  how long to wait, None: for ever. Any other reason why there is no such bus is raised at once.
    """
    deadline_s = math.inf if wait_s is None else time.monotonic() + wait_s
    waiting = False
    while not stop():
        try:
            return open_link(spec)
        except NotYet:
            if time.monotonic() >= deadline_s:
                raise
        if not waiting:
            waiting = True
            say(f"waiting for a bench on {spec}")
        time.sleep(RETRY_S)
    return None


def regain_link(spec: str, stop: Callable[[], bool]) -> Link | None:
    """A link on a bus that went away, once it is back; None if `stop` came first."""
    while not stop():
        try:
            return open_link(spec)
        except LinkError:
            time.sleep(RETRY_S)
    return None
