"""An embedded bus that belongs to no run: a hub, served until it is interrupted."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from gnss_hil.dbc.bus.embedded import FRAME
from gnss_hil.dbc.bus.hub import HELD_BACK_S, Hub
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.process.shutdown import Stop
from gnss_hil.tools.common.errors import PROGRAM, Failed

LOOK_S = 0.1
"""How often the hub is looked at."""


class _Count:
    """A tap that counts frames."""

    frames = 0

    def __call__(self, sender: int, wire: bytes) -> None:
        self.frames += len(wire) // FRAME


def serve(path: Path) -> int:
    """Serves a bus at `path` until a signal comes; the exit status. LinkError if it cannot be served there.

    What becomes of it meanwhile is told in a line each: a peer that was dropped, a socket that is gone.
    """
    count = _Count()
    with Stop() as stop, Hub(path, (count,)) as hub:
        print(f"{PROGRAM}: serving embedded:{path}; Ctrl-C ends it", flush=True)
        told, lost = 0, False
        while not stop() and hub.failure is None:
            time.sleep(LOOK_S)
            for number, process in hub.dropped[told:]:
                _say(f"peer {number} (process {process}) did not read for {HELD_BACK_S:g} s: dropped")
                told += 1
            if not lost and not hub.reachable:
                lost = True
                _say(f"embedded:{path}: the socket is no longer ours: those on the bus stay, nobody joins")
    if hub.failure is not None:
        raise Failed(f"the bus failed: {hub.failure}")
    odd = f", {hub.malformed} malformed left out" if hub.malformed else ""
    print(f"{PROGRAM}: {so_many(count.frames, 'frame')} of {so_many(hub.joined, 'peer')}{odd}")
    return stop.status


def _say(text: str) -> None:
    print(f"{PROGRAM}: {text}", file=sys.stderr, flush=True)
