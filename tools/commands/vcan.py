"""`gnss-hil vcan`: a virtual CAN bus where there is none."""

from __future__ import annotations

import argparse
import re
from argparse import Namespace

from gnss_hil.tools.common.errors import Mistake

_UNITS = {"M": 20, "G": 30}
_LEAST_BYTES, _MOST_BYTES = 128 << 20, 64 << 30


def add_arguments(parser: argparse.ArgumentParser) -> None:
    what = parser.add_subparsers(dest="what", metavar="WHAT", required=True, title="what")
    up = what.add_parser(
        "up", help="vcan0 on this kernel (needs root)", description="Virtual CAN on this kernel; needs root.",
        allow_abbrev=False,
    )  # fmt: skip
    up.add_argument("interfaces", nargs="*", metavar="INTERFACE", help="vcan0 if none is named")
    shell = what.add_parser(
        "shell", help="run COMMAND in a Linux of its own that has vcan0", allow_abbrev=False,
        description="Runs COMMAND in a user-mode Linux that has vcan0 and vcan1, on this machine's files.",
    )  # fmt: skip
    shell.add_argument(
        "--mem", type=memory, default="2G", metavar="SIZE",
        help="memory of that Linux, 128M to 64G (default 2G); it takes what is used of it",
    )  # fmt: skip
    shell.add_argument(
        "command", nargs=argparse.REMAINDER, metavar="-- COMMAND", help="what to run in the shell"
    )


def memory(text: str) -> int:
    """'512M', '2G': bytes."""
    found = re.fullmatch(r"([0-9]{1,6})([MG])", text)
    size = int(found[1]) << _UNITS[found[2]] if found else 0
    if not _LEAST_BYTES <= size <= _MOST_BYTES:
        raise argparse.ArgumentTypeError(f"'{text}': a size such as 512M or 2G, from 128M to 64G")
    return size


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.processes.vcan import interfaces, shell

    if arguments.what == "up":
        return interfaces.up(arguments.interfaces)
    command = arguments.command[1:] if arguments.command[:1] == ["--"] else arguments.command
    if not command:
        raise Mistake("vcan shell: no command; for example: gnss-hil vcan shell -- candump vcan0")
    return shell.shell(command, memory_bytes=arguments.mem)
