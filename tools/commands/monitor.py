"""`gnss-hil monitor`: listen on any bus, decode and check what is heard."""

from __future__ import annotations

import argparse
import sys
import time
from argparse import Namespace

from gnss_hil.tools.command_line import arguments as shared
from gnss_hil.tools.common.errors import INTERRUPTED, PROGRAM, Failed, Mistake

TURN_S = 0.1

_DESCRIPTION = """\
Listens on a bus and decodes live: a table on a terminal, one line a frame in a pipe. It never sends.
The bus is read however slow the output is: lines that find no room are left out and counted.
Ends after --duration, at Ctrl-C, or with the bus: status 0 if the bench ended its run, 1 if the bus
went away without a word."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "--bus", type=shared.bus, default="embedded", metavar="B",
        help="socketcan:vcan0, embedded:PATH, any python-can INTERFACE:CHANNEL; embedded (default): the bus "
        "of the bench that runs here",
    )  # fmt: skip
    add(
        "--vehicle",
        metavar="FILE",
        help="vehicle file, or name of a shipped one: its receivers",
    )
    add("--receivers", type=_receivers, metavar="N", help="receivers of the contract, 1 to 8 (default 4)")
    add(
        "--only", action="append", default=[], metavar="WHAT",
        help="message (RX1_RANGE, 'RX1_*'), kind (RANGE), sender (FLIGHT), identifier (0x100, 0x100-0x10F); "
        "repeatable, or with commas",
    )  # fmt: skip
    add("--raw", action="store_true", help="bytes instead of values; piped: candump's log format")
    add("--duration", type=shared.seconds, metavar="S", help="listen for this long (60, 10m)")
    parser.description = _DESCRIPTION


def _receivers(text: str) -> int:
    if text not in tuple("12345678"):
        raise argparse.ArgumentTypeError(f"'{text}': 1 to 8")
    return int(text)


def run(arguments: Namespace) -> int:
    from gnss_hil.dbc.bus.open_link import open_link
    from gnss_hil.dbc.contract.codec import codec
    from gnss_hil.dbc.process.shutdown import Stop
    from gnss_hil.tools.monitor.discovery import running_bus
    from gnss_hil.tools.monitor.filter import FrameFilter
    from gnss_hil.tools.monitor.format import Formatter

    contract = codec(_contract(arguments))
    formatter = Formatter(contract)
    wanted = FrameFilter(contract, formatter, arguments.only)
    if arguments.bus == "inline":
        raise Mistake("--bus inline: it is inside one process, nobody can listen")
    spec = running_bus() if arguments.bus == "embedded" else arguments.bus
    link = open_link(spec)
    try:
        with Stop() as stop:
            return _listen(arguments, spec, link, contract, wanted, formatter, stop)
    finally:
        link.close()


def _contract(arguments: Namespace) -> int:
    if arguments.vehicle is None:
        return arguments.receivers or 4
    from gnss_hil.dbc.common import vehicle

    antennas = vehicle.load(vehicle.find(arguments.vehicle)).antennas
    if arguments.receivers not in (None, antennas):
        raise Mistake(f"--receivers {arguments.receivers}: {arguments.vehicle} has {antennas} receivers")
    return antennas


def _listen(arguments: Namespace, spec: str, link, contract, wanted, formatter, stop) -> int:
    """Until the time is over, it is interrupted, or the bus ends; the exit status."""
    from gnss_hil.dbc.bus.base import LinkClosed
    from gnss_hil.tools.live.terminal import Terminal, can_draw
    from gnss_hil.tools.monitor.output import Piped, Table
    from gnss_hil.tools.monitor.stats import BusStats
    from gnss_hil.tools.monitor.table import totals

    stats = BusStats(contract)
    on_terminal = can_draw(sys.stdout)
    face = (
        Table(Terminal(sys.stdout), stats, wanted, formatter, arguments.raw, spec)
        if on_terminal
        else Piped(sys.stdout.fileno(), wanted, formatter, arguments.raw, spec)
    )
    begun = time.monotonic()
    end = begun + (arguments.duration or float("inf"))
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
    return INTERRUPTED if stop() else 0
