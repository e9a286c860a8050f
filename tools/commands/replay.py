"""`gnss-hil replay`: a recording played again, one side of it against real software."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gnss_hil.dbc.process.command_line import voice
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.command_line.arguments import pace, seconds
from gnss_hil.tools.common.errors import PROGRAM, Mistake
from gnss_hil.tools.run_config.config import EXTERNAL, OTHER_SIDE, OURS, ReplayConfig

LIMIT_S = 10.0

_AWAITS = "needs --only: without it nothing is awaited from anybody"
_OWN = "belongs to our own flight software: --only emulator --flight ours"
NEEDS = (
    ("out", lambda only, sides: only, _AWAITS),
    ("report", lambda only, sides: only, _AWAITS),
    ("same", lambda only, sides: only, _AWAITS),
    ("session", lambda only, sides: only == "emulator", "needs --only emulator"),
    ("policy", lambda only, sides: sides["flight"] == OURS, _OWN),
    ("navigator", lambda only, sides: sides["flight"] == OURS, _OWN),
    ("option", lambda only, sides: sides["flight"] == OURS, _OWN),
    (
        "pace",
        lambda only, sides: only != "flight",
        "with --only flight: the emulator on the bus has the time",
    ),
)
"""Options that others must allow: name, whether they do, what to say if not."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "run", type=Path, metavar="RUN",
        help="run folder, or a recording: .log (candump), .asc, .blf, .mf4",
    )  # fmt: skip
    add(
        "--only", choices=("emulator", "flight"),
        help="the side to play. emulator: as the master of time, all senders but FLIGHT; flight: what FLIGHT "
        "said, in the epochs that are heard on the bus. Without: every frame at its recorded time",
    )  # fmt: skip
    add(
        "--bus", default="embedded", metavar="B",
        help="embedded (default): a bus of our own with the other side started there; embedded:PATH: the "
        "bench that serves PATH, else a bus of our own there; socketcan:vcan0; or INTERFACE:CHANNEL",
    )  # fmt: skip
    add(
        "--flight", metavar="F",
        help="with --only emulator: ours (default on embedded), a COMMAND to start, or external (default on "
        "other buses)",
    )  # fmt: skip
    add("--emulator", metavar="E", help="with --only flight: the same")
    add("--pace", type=pace, metavar="P", help="lockstep (default with --only emulator), realtime, or xN")
    add("--craft", metavar="NAME", help="which craft, or bus, of a recording that has several")
    add("--vehicle", metavar="FILE", help="vehicle file, or a shipped one by name, instead of the run's")
    add(
        "--policy", metavar="P",
        help="policy of our flight software instead of the run's, whose navigator and options go with it",
    )  # fmt: skip
    add(
        "--navigator", metavar="N",
        help="navigator of our flight software instead of the run's, or of the policy's",
    )  # fmt: skip
    add(
        "--option", action="append", default=[], metavar="K=V",
        help="option of our flight software; repeatable",
    )  # fmt: skip
    add("--session", type=_session, metavar="N", help="time marks with this session, their CRC made anew")
    add(
        "--require", choices=("FLIGHT", "none"), default="FLIGHT",
        help="none: begin without the flight software's heartbeat (not in lockstep)",
    )  # fmt: skip
    add("--wait", type=seconds, metavar="S", help="wait for the heartbeat no longer than S")
    add("--limit", type=seconds, default=LIMIT_S, metavar="S", help="lockstep: wait S for an answer (10)")
    add("--out", type=Path, metavar="FILE", help="recording of both sides, in the format of its suffix")
    add("--force", action="store_true", help="overwrite FILE")
    add("--report", type=Path, metavar="DIR", help="run folder of the replay, with its report")
    add(
        "--same",
        action="store_true",
        help="exit status 1 if the other side does not say what it said then",
    )
    add("--quiet", action="store_true", help="no progress; the result is printed all the same")


def _session(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= 0xFFFF:
        raise argparse.ArgumentTypeError(f"'{text}': a whole number from 1 to 65535")
    return int(text)


def run(arguments: Namespace) -> int:
    from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
    from gnss_hil.dbc.process.shutdown import Stop
    from gnss_hil.tools.replay import damage, output, peer, session, source
    from gnss_hil.tools.results import assemble

    found = source.find(arguments.run, arguments.craft, arguments.vehicle)
    config = config_of(arguments)
    output.check(config.out, config.report, config.force, found)
    say, about = voice(PROGRAM, config.quiet), output.about_of(config, arguments.command_line)
    with Stop() as stop, RuntimeDir() as runtime_dir, peer.bus(config.bus, runtime_dir, say) as spec:
        played, folder = session.play(config, found, spec, runtime_dir, say, stop)
    different = config.same and played.comparison.different
    print("\n".join(output.account(config, played)))
    recording = found.recorded.recording
    found_lines = recording.found.lines(recording.path)
    changed = assemble.since_the_run(found.folder) if found.folder else ()
    lacking = damage.lines(found.recorded)
    for line in (*found_lines, *lacking, *changed):
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    if folder is not None:
        print(flush=True)
        _report(
            folder.path, source.scenario_of(found)[1], output.facts_of(found, config, played, about, lacking)
        )
    if stop():
        return stop.status
    return 1 if different else 0


def _report(folder: Path, scenario: Scenario, facts: Mapping[str, Any]) -> None:
    """Facts of the replay, then tables, summary and page as `gnss-hil report` makes them."""
    from gnss_hil.tools.commands import report
    from gnss_hil.tools.recording import fingerprints
    from gnss_hil.tools.recording.run_folder import FACTS, write_json

    record = fingerprints.of_record(folder, [craft.name for craft in scenario.craft])
    write_json(folder / FACTS, {**facts, "record": record})
    report.again(folder, None)


def config_of(a: Namespace) -> ReplayConfig:
    """Arguments with the defaults that depend on other options; Mistake for options that contradict each
    other."""
    sides = _sides(a)
    other = OTHER_SIDE.get(a.only)
    for name, needed, why in NEEDS:
        if getattr(a, name) and not needed(a.only, sides):
            raise Mistake(f"--{name} {why}")
    pace = a.pace or _pace(a.only, sides["emulator"])
    if a.only is None and pace == "lockstep":
        raise Mistake("--pace lockstep needs --only emulator; without it frames have their recorded times")
    if a.require == "none" and pace == "lockstep":
        raise Mistake("--require none in lockstep: every epoch would wait for an answer; use --pace realtime")
    if other:
        from gnss_hil.tools.run_config.sides import check

        check(
            sides["flight"] or OURS,
            sides["emulator"] or OURS,
            a.bus,
            {"policy": a.policy, "navigator": a.navigator, "option": a.option},
        )
    return ReplayConfig(
        recording=a.run, only=a.only, bus=a.bus, **sides, pace=pace, craft=a.craft, vehicle=a.vehicle,
        policy=a.policy, navigator=a.navigator, options=tuple(a.option), session=a.session,
        require=a.require, wait_s=a.wait, limit_s=a.limit, out=a.out, force=a.force, report=a.report,
        same=a.same, quiet=a.quiet,
    )  # fmt: skip


def _sides(a: Namespace) -> dict[str, str | None]:
    """Whose software is on the side that hears what is played."""
    other, own_bus = OTHER_SIDE.get(a.only), a.bus == "embedded"
    sides = {"flight": a.flight, "emulator": a.emulator}
    for side, whose in sides.items():
        if whose is not None and side != other:
            raise Mistake(f"--{side} needs --only {OTHER_SIDE[side]}")
    if other and sides[other] is None:
        sides[other] = OURS if own_bus else EXTERNAL
    if own_bus and (sides[other] == EXTERNAL if other else True):
        raise Mistake(
            "--bus embedded: nobody else can be there; name a bus (embedded:PATH, socketcan:vcan0), or play "
            "to our own software with --only emulator"
        )
    return sides


def _pace(only: str | None, emulator: str | None) -> str | None:
    if only is None:
        return "realtime"
    return None if emulator == EXTERNAL else "lockstep"
