"""`gnss-hil monitor`: listen on any bus, decode and check what is heard."""

from __future__ import annotations

import argparse
from argparse import Namespace

from gnss_hil.tools.command_line import arguments as shared
from gnss_hil.tools.common.errors import Mistake

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
    from gnss_hil.tools.monitor.listening import listen

    contract = codec(_contract(arguments))
    wanted = FrameFilter(contract, Formatter(contract), arguments.only)
    if arguments.bus == "inline":
        raise Mistake("--bus inline: it is inside one process, nobody can listen")
    spec = running_bus() if arguments.bus == "embedded" else arguments.bus
    link = open_link(spec)
    try:
        with Stop() as stop:
            return listen(link, spec, contract, wanted, arguments.raw, arguments.duration, stop)
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
