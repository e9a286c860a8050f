"""A replay from the moment its bus is there to the moment the other side has left."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.lockstep.master_loop import parse_pace
from gnss_hil.tools.command_line.arguments import EXTERNAL, OURS
from gnss_hil.tools.common.ticker import Ticker
from gnss_hil.tools.processes.children import BARRIER_S
from gnss_hil.tools.recording.run_folder import LOG, RunFolder
from gnss_hil.tools.replay import output, peer, players
from gnss_hil.tools.replay.source import Source

Say = Callable[[str], None]
Stop = Callable[[], bool]

_ROLES = {"emulator": "flight software", "flight": "emulator"}
"""Who is on the other side of what is played."""


def play(
    arguments: Namespace, source: Source, spec: str, private: Path, say: Say, stop: Stop
) -> tuple[players.Played, RunFolder | None]:
    """Plays what the arguments say; with --report the folder that holds the recording."""
    senders = set(source.recorded.codec.sender_of) - {""}
    nodes = {"emulator": senders - {"FLIGHT"}, "flight": {"FLIGHT"}, None: senders}[arguments.only]
    with peer.joined(spec, source.recorded.codec, nodes) as link:
        if arguments.only is None:
            return players.play_all(source.recorded, link, parse_pace(arguments.pace), stop), None
        with _other_side(arguments, source, spec, private / "words", say) as other:
            return _against(arguments, source, link, other, stop)


def _other_side(arguments: Namespace, source: Source, spec: str, words: Path, say: Say):
    """Whoever will hear the recorded run."""
    role = _ROLES[arguments.only]
    emulating = arguments.only == "emulator"
    whose = arguments.flight if emulating else arguments.emulator
    if whose == EXTERNAL:
        if arguments.require != "none":
            say(f"waiting for the {role} on {spec}")
        return peer.other_side(None, role, {}, None)
    if whose != OURS:
        told = peer.told(source, spec, of_run=not emulating)
        return peer.other_side(peer.words_of(whose), role, told, None)
    if emulating:
        command = peer.flight_command(source, spec, arguments.policy, arguments.option)
    else:
        command = peer.emulator_command(source, spec, BARRIER_S)
    return peer.other_side(command, role, {}, words)


def _against(
    arguments: Namespace, source: Source, link: Link, other: peer.Other, stop: Stop
) -> tuple[players.Played, RunFolder | None]:
    """A side of the recorded run against the other's software."""
    emulating = arguments.only == "emulator"
    folder = output.make_folder(arguments.report, source, truth=emulating) if arguments.report else None
    ticker = Ticker("epochs", arguments.quiet)

    def over() -> bool:
        return stop() or other.gone

    try:
        with output.recording_at(source.recorded, folder / LOG if folder else arguments.out) as keep:

            def kept(number, emulator, flight):
                keep(number, emulator, flight)
                ticker.show(number + 1 - source.recorded.first)

            if emulating:
                how = players.Mastery(
                    parse_pace(arguments.pace),
                    arguments.require == "FLIGHT",
                    arguments.wait or (BARRIER_S if other.started else None),
                    arguments.limit,
                    arguments.session,
                )
                played = players.play_emulator(source.recorded, link, how, kept, over)
            else:
                played = players.play_flight(source.recorded, link, kept, over)
            other.end(played.complete, interrupted=stop())
    except BaseException:
        if folder is not None:
            folder.discard()
        raise
    finally:
        ticker.close()
    return played, folder
