"""The two sides of a bus, each ours, a command to start, or external: one that somebody else starts."""

from __future__ import annotations

import shlex
import shutil
from argparse import Namespace

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.tools.command_line.arguments import EXTERNAL, OURS
from gnss_hil.tools.common.errors import Mistake


def check(arguments: Namespace) -> None:
    """Mistake if somebody else's software cannot be started, or other options leave it no place."""
    for side in ("flight", "emulator"):
        whose = getattr(arguments, side)
        if whose == OURS:
            continue
        if arguments.bus == "inline":
            raise Mistake(f"--{side} {whose} with --bus inline: inline has no bus to join; use embedded")
        if whose != EXTERNAL:
            _check_command(side, whose)
    for name in ("policy", "option") if arguments.flight != OURS else ():
        if getattr(arguments, name):
            raise Mistake(f"--{name} with --flight {arguments.flight}: it belongs to our own flight software")


def _check_command(side: str, command: str) -> None:
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise Mistake(f"--{side} {command!r}: not a command: {error}") from None
    if not words or shutil.which(words[0]) is None:
        raise Mistake(f"--{side} {command!r}: no such program")


def awaited(codec: Codec, arguments: Namespace) -> set[str]:
    """Nodes that may be on a bus before the run begins there."""
    flight = {"FLIGHT"}
    others = {*codec.sender_of} - flight
    return (flight if arguments.flight == EXTERNAL else set()) | (
        others if arguments.emulator == EXTERNAL else set()
    )
