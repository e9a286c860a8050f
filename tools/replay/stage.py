"""A replay from the moment its bus is there to the moment the other side has left."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

from dbc.link.base import Link
from dbc.link.conductor import parse_pace
from tools.arguments import EXTERNAL, OURS
from tools.bench.children import BARRIER_S
from tools.folder import LOG, RunFolder
from tools.log.ticker import Ticker
from tools.replay import company, keeping, sides
from tools.replay.source import Source

Say = Callable[[str], None]
Stop = Callable[[], bool]

_ROLES = {"emulator": "flight software", "flight": "emulator"}
"""Who is on the other side of what is played."""


def play(
    arguments: Namespace, source: Source, spec: str, private: Path, say: Say, stop: Stop
) -> tuple[sides.Played, RunFolder | None]:
    """Plays what the arguments say; with --report the folder that holds the recording."""
    senders = set(source.tape.codec.sender_of) - {""}
    nodes = {"emulator": senders - {"FLIGHT"}, "flight": {"FLIGHT"}, None: senders}[arguments.only]
    with company.joined(spec, source.tape.codec, nodes) as link:
        if arguments.only is None:
            return sides.play_all(source.tape, link, parse_pace(arguments.pace), stop), None
        with _other_side(arguments, source, spec, private / "words", say) as other:
            return _against(arguments, source, link, other, stop)


def _other_side(arguments: Namespace, source: Source, spec: str, words: Path, say: Say):
    """Whoever will hear the tape."""
    role = _ROLES[arguments.only]
    emulating = arguments.only == "emulator"
    whose = arguments.flight if emulating else arguments.emulator
    if whose == EXTERNAL:
        if arguments.require != "none":
            say(f"waiting for the {role} on {spec}")
        return company.other_side(None, role, {}, None)
    if whose != OURS:
        told = company.told(source, spec, of_run=not emulating)
        return company.other_side(company.words_of(whose), role, told, None)
    if emulating:
        command = company.flight_command(source, spec, arguments.policy, arguments.option)
    else:
        command = company.emulator_command(source, spec, BARRIER_S)
    return company.other_side(command, role, {}, words)


def _against(
    arguments: Namespace, source: Source, link: Link, other: company.Other, stop: Stop
) -> tuple[sides.Played, RunFolder | None]:
    """A side of the tape against the other's software."""
    emulating = arguments.only == "emulator"
    folder = keeping.make_folder(arguments.report, source, truth=emulating) if arguments.report else None
    ticker = Ticker("epochs", arguments.quiet)

    def over() -> bool:
        return stop() or other.gone

    try:
        with keeping.recording_at(source.tape, folder / LOG if folder else arguments.out) as keep:

            def kept(number, emulator, flight):
                keep(number, emulator, flight)
                ticker.show(number + 1 - source.tape.first)

            if emulating:
                how = sides.Mastery(
                    parse_pace(arguments.pace),
                    arguments.require == "FLIGHT",
                    arguments.wait or (BARRIER_S if other.started else None),
                    arguments.limit,
                    arguments.session,
                )
                played = sides.play_emulator(source.tape, link, how, kept, over)
            else:
                played = sides.play_flight(source.tape, link, kept, over)
            other.end(played.complete, interrupted=stop())
    except BaseException:
        if folder is not None:
            folder.discard()
        raise
    finally:
        ticker.close()
    return played, folder
