"""`python -m gnss_hil.emulator`: the emulator as a process on a bus, time master of the run."""

from __future__ import annotations

import os
import sys

# One BLAS thread, before NumPy is loaded: the same sums in the same order, and no spinning helpers.
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import gc
import secrets
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.process import command_line

EXAMPLES = """\
examples:
  python -m gnss_hil.emulator soyuz --bus socketcan:vcan0 --pace realtime
  python -m gnss_hil.emulator my-scenario.toml --bus embedded:/run/bench/bus.sock --truth truth --status fd:3

BUS is embedded:/path.sock, socketcan:vcan0 (socketcan:can0,paced spreads bursts over bit time), or any
python-can INTERFACE:CHANNEL. Exit status: 0 done; 1 the run failed; 2 bad usage or scenario;
3 the environment lacks something; 130 interrupted, 143 terminated, 129 hung up."""


World = Callable[[int, float | None], tuple[Any, Any]]
"""Makes, of session and pace (None: lockstep), scenario and world."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """All arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="a shipped scenario's name or a .toml file")
    add("--duration", metavar="S", type=command_line.seconds, help="simulated time: seconds, or 10m, 24h, 1d")
    add("--seed", metavar="N", type=command_line.whole(0, 2**63 - 1), help="seed instead of the scenario's")
    add_bus_arguments(parser)


def add_bus_arguments(parser: argparse.ArgumentParser) -> None:
    """What says how it is played, and where; also for `gnss-hil emulate`."""
    add = parser.add_argument
    add("--bus", metavar="[CRAFT=]BUS", action="append", required=True, help="one for each craft")
    add("--pace", metavar="PACE", default="lockstep", help="lockstep (default), realtime, or xN")
    add(
        "--session", metavar="N", type=command_line.whole(1, 0xFFFF),
        help="run identifier, 16 bit (default: drawn anew)",
    )  # fmt: skip
    add("--truth", metavar="FILE", type=Path, help="write the truth here as it happens")
    add("--events", metavar="FILE", type=Path, help="write what faults did here as it happens")
    add("--status", metavar="FILE|fd:N", help="write progress here as JSON lines")
    add("--require", metavar="NODES", default="FLIGHT", help="nodes to wait for, comma-separated, or 'none'")
    add(
        "--wait",
        metavar="S",
        type=command_line.seconds,
        help="wait for bus and nodes no longer than S seconds",
    )
    add(
        "--limit", metavar="S", type=command_line.seconds, default=10.0,
        help="lockstep: wait S for an answer (default: 10)",
    )  # fmt: skip
    add(
        "--unanswered", metavar="N", type=command_line.whole(0, 1_000_000), default=6,
        help="end the run after N epochs in a row without an answer, at a pace after N times --limit of "
        "silence (default: 6; 0: never)",
    )  # fmt: skip
    add("--quiet", action="store_true", help="nothing on stderr but mistakes")


def main(argv: Sequence[str] | None = None) -> int:
    parser = command_line.parser_of(
        "python -m gnss_hil.emulator",
        "Plays a scenario on a bus: receivers, attitude unit and time mark.",
        EXAMPLES,
    )
    add_arguments(parser)
    return run(parser.parse_args(argv))


def run(arguments: argparse.Namespace, world: World | None = None) -> int:
    """Plays what the arguments say; the exit status. Mistakes become lines on stderr.

    world   makes what is played; None: of the arguments
    """
    made = world or partial(_world, arguments)
    return command_line.guarded("emulator", lambda stop: _told(lambda: _play(arguments, made, stop)))


def _told(work: Callable[[], int]) -> int:
    """What work returns; an error model or a sensor that fails is a line."""
    from gnss_hil.emulator.error_models.checked import ModelError

    try:
        return work()
    except ModelError as error:
        raise command_line.Broken(error) from error


def _play(arguments: argparse.Namespace, make: World, stop) -> int:
    from gnss_hil.dbc.contract.messages import node_names
    from gnss_hil.dbc.lockstep.master_loop import Bus, MasterLoop, MissingNodes, Unanswered, parse_pace
    from gnss_hil.dbc.process.status_log import StatusLog
    from gnss_hil.emulator.journal import FaultLog, TruthLog
    from gnss_hil.emulator.truth import TRUTH

    try:
        pace = parse_pace(arguments.pace)
    except ValueError as error:
        raise command_line.Mistake(f"--{error}") from None
    session = _fresh_session() if arguments.session is None else arguments.session
    scenario, world = make(session, pace)
    specs = _bus_specs(arguments.bus, [craft.name for craft in world.craft])
    say = command_line.voice("emulator", arguments.quiet)
    for remark in world.remarks:
        say(remark)
    with ExitStack() as stack:
        truth = stack.enter_context(
            _opened(lambda: TruthLog(arguments.truth, TRUTH, list(specs)), arguments.truth)
        )
        fates = stack.enter_context(
            _opened(lambda: FaultLog(arguments.events, world.faults), arguments.events)
        )
        status = stack.enter_context(_opened(lambda: StatusLog(arguments.status), arguments.status))
        buses = {}
        for craft in world.craft:
            link = _join(specs[craft.name], craft.codec, stop, say, arguments.wait)
            if link is None:
                return stop.status
            stack.callback(link.close)
            buses[craft.name] = Bus(link, craft.codec, specs[craft.name])
        master = MasterLoop(
            buses, session, pace, scenario.time.epoch_interval_s, limit_s=arguments.limit,
            most_unanswered=arguments.unanswered or None, stop=stop,
        )  # fmt: skip
        required = _required(arguments.require, node_names(max(len(c.vehicle.names) for c in world.craft)))
        status.tell("waiting", for_nodes=arguments.require)
        awaited = arguments.require.replace("FLIGHT", "the flight software")
        say(f"waiting for {awaited} on {', '.join(specs.values())}")

        def tell(text: str) -> None:
            status.tell("waiting", waiting=text)
            say(text)

        try:
            master.assemble(required, arguments.wait, tell)
            epochs = _epochs(world, scenario.time.epochs, master, truth, fates, status, stop, say)
        except (MissingNodes, Unanswered) as error:
            raise command_line.Broken(error) from None
    completed = epochs == scenario.time.epochs
    return 0 if completed else stop.status


def _fresh_session() -> int:
    """A run identifier that the last run did not have: 16 bits, never 0."""
    return secrets.randbelow(0xFFFF) + 1


def _world(arguments: argparse.Namespace, session: int, pace: float | None):
    """Scenario with the command line's changes, and the world it describes."""
    from gnss_hil.dbc.common import vehicle
    from gnss_hil.emulator.assemble import build_world
    from gnss_hil.emulator.config import scenario as scenarios
    from gnss_hil.emulator.config.named_files import anchor, refuse_missing

    try:
        path = scenarios.find(arguments.scenario)
        document = scenarios.read(path)
        missing = anchor(document, path.parent)
        if arguments.duration is not None:
            document.setdefault("time", {})["duration_s"] = arguments.duration
        if arguments.seed is not None:
            document["seed"] = arguments.seed
        scenario = scenarios.parse(document, str(path))
        refuse_missing(document, missing)
        vehicles = [vehicle.load(scenarios.vehicle_path(craft, path)) for craft in scenario.craft]
        period_s = None if pace is None else scenario.time.epoch_interval_s / pace
        return scenario, build_world(scenario, vehicles, session, period_s=period_s)
    except (scenarios.ScenarioError, vehicle.VehicleError) as error:
        raise command_line.Mistake(error) from None


def _bus_specs(given: Sequence[str], craft: Sequence[str]) -> dict[str, str]:
    """Bus by craft: CRAFT=BUS, or the bus alone where there is one craft."""
    specs = {}
    for text in given:
        name, equals, spec = text.partition("=")
        if not (equals and name in craft):
            name, spec = craft[0] if len(craft) == 1 else "", text
        if not name or name in specs:
            raise command_line.Mistake(f"--bus {text}: give one CRAFT=BUS for each craft: {', '.join(craft)}")
        specs[name] = spec
    missing = [name for name in craft if name not in specs]
    if missing:
        raise command_line.Mistake(f"--bus: none given for craft {', '.join(missing)}")
    return {name: specs[name] for name in craft}


def _required(text: str, nodes: dict[str, int]) -> tuple[int, ...]:
    names = [] if text == "none" else text.split(",")
    unknown = [name for name in names if name not in nodes]
    if unknown:
        raise command_line.Mistake(
            f"--require: no node '{unknown[0]}'; allowed are {', '.join(nodes)}, or none"
        )
    return tuple(nodes[name] for name in names)


def _opened(make: Callable, target):
    try:
        return make()
    except (OSError, ValueError) as error:
        raise command_line.Mistake(f"{target}: {getattr(error, 'strerror', None) or error}") from None


def _join(spec: str, codec, stop, say, wait_s: float | None):
    """A link on a bus without another spacecraft; None if `stop` came first."""
    from gnss_hil.dbc.bus.base import LinkError
    from gnss_hil.dbc.bus.open_link import is_shared
    from gnss_hil.dbc.bus.probe import senders_heard
    from gnss_hil.dbc.process.bus_link import await_link

    link = await_link(spec, stop, say, wait_s)
    if link is not None and is_shared(spec):
        others = senders_heard(link, codec, set(codec.sender_of) - {"", "FLIGHT"})
        if others:
            link.close()
            raise LinkError(f"bus '{spec}': {', '.join(sorted(others))} of another bench can be heard there")
    return link


def _epochs(world, epochs: int, master, truth, fates, status, stop, say) -> int:
    """All epochs from first to last or to the interruption; how many were played."""
    from gnss_hil.dbc.contract.frames import EMPTY
    from gnss_hil.dbc.lockstep.master_loop import Unanswered
    from gnss_hil.emulator.assemble import initial_state
    from gnss_hil.emulator.step import emulate_step

    state = initial_state(world)
    inbox = {craft.name: EMPTY for craft in world.craft}
    begun_s = time.monotonic()
    played, reason = 0, "FAILED"
    gc.freeze()  # what was built before the loop lives through it: nothing there to collect
    status.tell("begun", epochs=epochs)
    try:
        while played < epochs and not stop():
            state, blocks, rows = emulate_step(world, state, inbox, played)
            now_s = time.monotonic()
            truth.add(rows, now_s)
            fates.add(state.events, now_s)
            inbox = master.play(played, blocks, partial(_ahead, world, state, played + 1, epochs))
            played += 1
            if status.due(now_s):
                status.tell(
                    "progress", **_standing(world, played, master, now_s - begun_s), **_acting(world, state)
                )
        reason = "COMPLETED" if played == epochs else "INTERRUPTED"
        master.end(played, reason)
    except Unanswered:
        master.end(played + 1, reason)
        raise
    finally:
        standing = _standing(world, played, master, time.monotonic() - begun_s)
        status.tell("ended", reason=reason, **standing, **_tallied(master, state))
        late = f", marks at most {1e3 * master.tally.late_s:.1f} ms late" if master.paced else ""
        many = so_many(played, "epoch")
        say(f"{reason.lower()} after {many}, {standing['epochs_unanswered']} unanswered{late}")
    return played


def _ahead(world, state, epoch: int, epochs: int) -> None:
    """Work for the next epoch, if there is one."""
    from gnss_hil.emulator.step import prepare_step

    if epoch < epochs:
        prepare_step(world, state, epoch)


def _standing(world, played: int, master, wall_s: float) -> dict:
    simulated_s = played * world.interval_ns / 1e9
    return {
        "epoch": played,
        "t_gps_ns": world.start_ns + max(played - 1, 0) * world.interval_ns,
        "wall_s": round(wall_s, 3),
        "real_time_factor": round(simulated_s / wall_s, 3) if wall_s > 0 else None,
        "epochs_unanswered": master.tally.unanswered,
        "answers_late": master.late,
        "frames_lost": master.lost,
    }


def _acting(world, state) -> dict:
    """Names of the faults that act, where some are armed."""
    from gnss_hil.emulator.faults import ledger

    return {"faults_acting": ledger.acting(world.faults, state.events)} if world.faults else {}


def _tallied(master, state) -> dict:
    from gnss_hil.emulator.state import commands_rejected

    tally = master.tally
    percentiles = {f"p{p}": tally.latency.percentile_s(p) for p in (50, 99)}
    return {
        "frames": {"sent": tally.sent, "received": tally.received, "lost": master.lost},
        "mark_late_ms": round(tally.late_s * 1e3, 3) if master.paced else None,
        "epoch_latency_ms": {k: None if v is None else round(v * 1e3, 4) for k, v in percentiles.items()},
        "latency_histogram": tally.latency.histogram(),
        "commands_rejected": commands_rejected(state),
    }


if __name__ == "__main__":
    sys.exit(main())
