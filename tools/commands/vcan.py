"""`gnss-hil vcan`: a virtual CAN bus where there is none."""

from __future__ import annotations

import argparse
from argparse import Namespace

from gnss_hil.tools.common.errors import Mistake


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "what", choices=("up", "shell"), metavar="WHAT",
        help="up: vcan0 on this kernel (needs root); shell: run COMMAND in a Linux of its own that has vcan0",
    )  # fmt: skip
    parser.add_argument(
        "command", nargs=argparse.REMAINDER, metavar="-- COMMAND", help="what to run in the shell"
    )


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.processes import vcan

    command = arguments.command[1:] if arguments.command[:1] == ["--"] else arguments.command
    if arguments.what == "up":
        return vcan.up(command)
    if not command:
        raise Mistake("vcan shell: no command; for example: gnss-hil vcan shell -- candump vcan0")
    return vcan.shell(command)
