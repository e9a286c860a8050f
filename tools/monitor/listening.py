"""The monitor at work: frames of a link into a face, until the time is over or the bus ends."""

from __future__ import annotations

import sys
import time

from gnss_hil.dbc.bus.base import Link, LinkClosed
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.process.shutdown import Stop
from gnss_hil.tools.common.errors import PROGRAM, Failed
from gnss_hil.tools.live.terminal import Terminal, can_draw
from gnss_hil.tools.monitor.filter import FrameFilter
from gnss_hil.tools.monitor.format import Formatter
from gnss_hil.tools.monitor.output import Piped, Table
from gnss_hil.tools.monitor.stats import BusStats
from gnss_hil.tools.monitor.table import totals

TURN_S = 0.1


def listen(
    link: Link,
    spec: str,
    contract: Codec,
    wanted: FrameFilter,
    raw: bool,
    duration_s: float | None,
    stop: Stop,
) -> int:
    """Until the time is over, it is interrupted, or the bus ends; the exit status.

    spec   what the link is on;  wanted   what is shown;  raw   bytes instead of values
    """
    formatter, stats = Formatter(contract), BusStats(contract)
    on_terminal = can_draw(sys.stdout)
    face = (
        Table(Terminal(sys.stdout), stats, wanted, formatter, raw, spec)
        if on_terminal
        else Piped(sys.stdout.fileno(), wanted, formatter, raw, spec)
    )
    begun = time.monotonic()
    end = begun + (duration_s or float("inf"))
    gone = None
    try:
        while not stop() and (rest := end - time.monotonic()) > 0:
            try:
                frames = link.receive(min(TURN_S, rest))
            except LinkClosed as error:
                gone = str(error) or "gone"
                break
            if len(frames):
                face.hear(frames, stats.hear(frames, time.monotonic()))
            face.refresh(link.dropped)
    finally:
        face.close()
    seconds = time.monotonic() - begun
    text = totals(stats, wanted, formatter, seconds, link.dropped, face.left_out)
    print(text, file=sys.stdout if on_terminal else sys.stderr)
    if gone and not stats.ended:
        raise Failed(f"bus {spec}: {gone}")
    if gone:
        print(f"{PROGRAM}: the bench has ended its run", file=sys.stderr)
    return stop.status if stop() else 0
