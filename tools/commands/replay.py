"""`gnss-hil replay`: a recording played again, one side of it against real software."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from pathlib import Path

from gnss_hil.tools.command_line.arguments import EXTERNAL, OURS, pace, seconds
from gnss_hil.tools.common.errors import INTERRUPTED, PROGRAM, Mistake

LIMIT_S = 10.0

OTHER_SIDE = {"emulator": "flight", "flight": "emulator"}
"""Who hears the side that is played."""

OWN = "belongs to our own flight software: --only emulator --flight ours"
NEEDS = (
    ("out", lambda a: a.only, "needs --only: without it nothing is awaited from anybody"),
    ("report", lambda a: a.only, "needs --only: without it nothing is awaited from anybody"),
    ("same", lambda a: a.only, "needs --only: without it nothing is awaited from anybody"),
    ("session", lambda a: a.only == "emulator", "needs --only emulator"),
    (
        "policy",
        lambda a: a.flight == OURS,
        OWN,
    ),
    (
        "option",
        lambda a: a.flight == OURS,
        OWN,
    ),
    ("pace", lambda a: a.only != "flight", "with --only flight: the emulator on the bus has the time"),
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
    add("--policy", metavar="P", help="policy of our flight software instead of the run's")
    add("--option", action="append", default=[], metavar="K=V", help="option of the policy; repeatable")
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
    add("--quiet", action="store_true", help="no progress")


def _session(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= 0xFFFF:
        raise argparse.ArgumentTypeError(f"'{text}': a whole number from 1 to 65535")
    return int(text)


def run(arguments: Namespace) -> int:
    settle(arguments)
    from gnss_hil.dbc.bus.runtime_dir import PrivateFolder
    from gnss_hil.dbc.process.shutdown import Stop
    from gnss_hil.tools.replay import output, peer, session, source

    found = source.find(arguments.run, arguments.craft, arguments.vehicle)
    output.check(arguments.out, arguments.report, arguments.force, found)
    say = _silent if arguments.quiet else _say
    with Stop() as stop, PrivateFolder() as private, peer.bus(arguments.bus, private, say) as spec:
        played, folder = session.play(arguments, found, spec, private, say, stop)
    for line in _account(arguments, played):
        print(line)
    if folder is not None:
        print(flush=True)
        output.report(folder, found, arguments, played)
    if stop():
        return INTERRUPTED
    return 1 if arguments.same and played.comparison.different else 0


def settle(a: Namespace) -> None:
    """Puts in defaults that depend on other options; Mistake for options that contradict each other."""
    other = OTHER_SIDE.get(a.only)
    private = a.bus == "embedded"
    for side in ("flight", "emulator"):
        if getattr(a, side) is not None and side != other:
            raise Mistake(f"--{side} needs --only {OTHER_SIDE[side]}")
    if other and getattr(a, other) is None:
        setattr(a, other, OURS if private else EXTERNAL)
    if private and getattr(a, other or "only") in (EXTERNAL, None):
        raise Mistake("--bus embedded: nobody else can be there; name a bus (embedded:PATH, socketcan:vcan0)")
    for name, needed, why in NEEDS:
        if getattr(a, name) and not needed(a):
            raise Mistake(f"--{name} {why}")
    a.pace = a.pace or ("realtime" if a.only is None else None if a.emulator == EXTERNAL else "lockstep")
    if a.only is None and a.pace == "lockstep":
        raise Mistake("--pace lockstep needs --only emulator; without it frames have their recorded times")
    if a.require == "none" and a.pace == "lockstep":
        raise Mistake("--require none in lockstep: every epoch would wait for an answer; use --pace realtime")
    if other:
        from gnss_hil.tools.processes import sides

        sides.check(Namespace(**{**vars(a), "flight": a.flight or OURS, "emulator": a.emulator or OURS}))


def _say(text: str) -> None:
    print(f"{PROGRAM}: {text}", file=sys.stderr, flush=True)


def _silent(text: str) -> None:
    pass


def _account(arguments: Namespace, played) -> list[str]:
    """What a replay showed."""
    wall = f"{played.wall_s:.1f} s"
    if arguments.only is None:
        return [f"replayed    {played.sent} frames in {wall}; {played.heard} heard from others"]
    lines = [f"replayed    {played.epochs} epochs in {wall}: {played.sent} frames sent, {played.heard} heard"]
    if arguments.only == "emulator" and arguments.pace == "lockstep":
        lines.append(f"unanswered  {played.tally.unanswered} epochs")
    lines.append(f"{OTHER_SIDE[arguments.only]:<11} {played.comparison.told}")
    return lines
