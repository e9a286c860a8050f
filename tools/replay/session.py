"""A replay from the moment its bus is there to the moment the other side has left."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.lockstep.master_loop import parse_pace
from gnss_hil.tools.common.ticker import Ticker
from gnss_hil.tools.processes.children import BARRIER_S
from gnss_hil.tools.recording.run_folder import LOG, RunFolder
from gnss_hil.tools.replay import output, peer, players
from gnss_hil.tools.replay.source import Source
from gnss_hil.tools.run_config.config import EXTERNAL, OURS, ReplayConfig

Say = Callable[[str], None]
Stop = Callable[[], bool]


def play(
    config: ReplayConfig, source: Source, spec: str, runtime_dir: Path, say: Say, stop: Stop
) -> tuple[players.Played, RunFolder | None]:
    """Plays a recording; with --report the folder that holds the recording."""
    senders = set(source.recorded.codec.sender_of) - {""}
    nodes = {"emulator": senders - {"FLIGHT"}, "flight": {"FLIGHT"}, None: senders}[config.only]
    with peer.joined(spec, source.recorded.codec, nodes) as link:
        if config.only is None:
            pace = parse_pace(config.pace or "realtime") or 1.0
            return players.play_all(source.recorded, link, pace, stop), None
        with _other_side(config, source, spec, runtime_dir / "words", say) as other:
            return _against(config, source, link, spec, other, stop)


def _other_side(config: ReplayConfig, source: Source, spec: str, words: Path, say: Say):
    """The software that the recorded run is played to."""
    emulating = config.only == "emulator"
    role = "flight software" if emulating else "emulator"
    whose = (config.flight if emulating else config.emulator) or OURS
    if whose == EXTERNAL:
        if config.require != "none":
            say(f"waiting for the {role} on {spec}")
        return peer.other_side(None, role, {}, None)
    if whose != OURS:
        environment = peer.environment_of(source, spec, of_run=not emulating)
        return peer.other_side(peer.words_of(whose), role, environment, None)
    if emulating:
        command = peer.flight_command(source, spec, config.policy, config.navigator, config.options)
    else:
        command = peer.emulator_command(source, spec, BARRIER_S)
    return peer.other_side(command, role, {}, words)


def _against(
    config: ReplayConfig, source: Source, link: Link, spec: str, other: peer.Other, stop: Stop
) -> tuple[players.Played, RunFolder | None]:
    """A side of the recorded run against the other's software."""
    emulating = config.only == "emulator"
    folder = output.make_folder(config.report, source, truth=emulating) if config.report else None
    ticker = Ticker("epochs", config.quiet)

    def over() -> bool:
        return stop() or other.gone

    try:
        with output.recording_at(source.recorded, folder / LOG if folder else config.out) as keep:

            def kept(number, emulator, flight):
                keep(number, emulator, flight)
                ticker.show(number + 1 - source.recorded.first)

            if emulating:
                how = players.Mastery(
                    parse_pace(config.pace or "lockstep"),
                    config.require == "FLIGHT",
                    config.wait_s or (BARRIER_S if other.started else None),
                    config.limit_s,
                    config.session,
                    by_fixes=config.flight != OURS,
                )
                played = players.play_emulator(source.recorded, link, how, kept, over, spec)
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
