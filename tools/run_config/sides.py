"""The two sides of a bus, each ours, a command to start, or external: one that is started elsewhere."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Mapping
from pathlib import Path

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config.config import EXTERNAL, OURS


def check(flight: str, emulator: str, bus: str, own: Mapping[str, object]) -> None:
    """Mistake if another's software cannot be started, or other options leave it no place.

    own   arguments that belong to our own flight software, by name
    """
    for side, whose in (("flight", flight), ("emulator", emulator)):
        if whose == OURS:
            continue
        if bus == "inline":
            raise Mistake(f"--{side} {whose} with --bus inline: inline has no bus to join; use embedded")
        if whose != EXTERNAL:
            _check_command(side, whose)
    for name, given in own.items() if flight != OURS else ():
        if given:
            raise Mistake(f"--{name} with --flight {flight}: it belongs to our own flight software")


def _check_command(side: str, command: str) -> None:
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise Mistake(f"--{side} {command!r}: not a command: {error}") from None
    if words and shutil.which(words[0]) is not None:
        return
    if words and Path(words[0]).is_file():
        raise Mistake(f"--{side} {command!r}: {words[0]} is not executable; name what runs it before it")
    raise Mistake(f"--{side} {command!r}: no such program")


def awaited(codec: Codec, flight: str, emulator: str) -> set[str]:
    """Nodes that may be on a bus before the run begins there."""
    flights = {"FLIGHT"}
    others = {*codec.sender_of} - flights
    return (flights if flight == EXTERNAL else set()) | (others if emulator == EXTERNAL else set())
