"""`gnss-hil run`: a scenario played from end to end, into a run folder."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from gnss_hil.tools.command_line.arguments import add_changes, add_scenario, bus, overrides_of, pace
from gnss_hil.tools.common.errors import INTERRUPTED, PROGRAM, Mistake
from gnss_hil.tools.run_config.config import EXTERNAL, OURS, RunConfig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_scenario(parser)
    add_changes(parser)
    add = parser.add_argument
    add("--pace", type=pace, default="lockstep", metavar="P", help="lockstep (default), realtime, or xN")
    add(
        "--bus", type=bus, default="embedded", metavar="B",
        help="embedded (default): two processes on a bus of our own; embedded:PATH: the same, its socket "
        "where you say; inline: one process, fastest; socketcan:vcan0; or any python-can INTERFACE:CHANNEL",
    )  # fmt: skip
    add(
        "--flight", default=OURS, metavar="F",
        help="another flight software: a COMMAND to start, which finds its bus, vehicle file and craft in "
        "GNSS_HIL_BUS, GNSS_HIL_VEHICLE and GNSS_HIL_CRAFT; or external: one that you start yourself",
    )  # fmt: skip
    add(
        "--emulator", default=OURS, metavar="E",
        help="another emulator or receiver: a COMMAND to start, which finds besides these GNSS_HIL_SCENARIO, "
        "GNSS_HIL_PACE and GNSS_HIL_DURATION [s]; or external: one that you start yourself",
    )  # fmt: skip
    add("--out", type=Path, metavar="DIR", help="run folder (default runs/<scenario>-<date>-<time>)")
    add("--junit", type=Path, metavar="FILE", help="write the verdict as JUnit XML too")
    add("--no-log", action="store_true", help="no bus.log and no channels.parquet: for very long runs")
    add("--no-report", action="store_true", help="no report.html")
    add("--plain", action="store_true", help="one line of progress on a terminal too, not the live view")
    add("--quiet", action="store_true", help="no progress")


def config_of(a: Namespace) -> RunConfig:
    return RunConfig(
        a.scenario, overrides_of(a), a.pace, a.bus, a.flight, a.emulator, a.out, a.junit,
        log=not a.no_log, report=not a.no_report, plain=a.plain, quiet=a.quiet,
    )  # fmt: skip


def run(arguments: Namespace) -> int:
    config = config_of(arguments)
    check_combination(config)
    from gnss_hil.tools.recording.run_folder import RunFolder, default_path, naming
    from gnss_hil.tools.run_config import plan as plans
    from gnss_hil.tools.run_config import sides

    plan = plans.make(config.scenario, config.overrides)
    _tell_dropped(plan)
    if config.bus not in ("inline", "embedded"):
        if len(plan.names) > 1:
            raise Mistake(
                f"--bus {config.bus}: each of {len(plan.names)} craft has its own bus; use embedded"
            )
        if not config.bus.startswith("embedded:"):
            from gnss_hil.tools.processes.bus_tap import check_bus

            check_bus(
                config.bus, plan.codecs[0], sides.awaited(plan.codecs[0], config.flight, config.emulator)
            )
    folder = RunFolder(config.out or default_path(plan.scenario.name))
    recording = _Recording()
    try:
        with naming(folder.path):
            folder.describe(plan.scenario, plan.vehicle_texts)
            outcome, digests = _play(plan, config, folder, recording)
    except BaseException:
        if recording.begun:
            print(f"run folder with everything up to here: {folder.path}", file=sys.stderr)
        else:
            folder.discard()
        raise
    if not outcome.epochs:  # interrupted before it began
        folder.discard()
        return INTERRUPTED
    return _finish(plan, config, folder, outcome, digests)


def _tell_dropped(plan) -> None:
    """Observations of a played receiver that cannot be used."""
    for craft in plan.world.craft:
        tracks = getattr(craft, "tracks", None)
        if tracks is not None and tracks.dropped:
            print(
                f"{PROGRAM}: {craft.name}: {tracks.dropped} of {tracks.dropped + len(tracks)} observations "
                "are left out: alone in time, hence without a range rate, or without a channel",
                file=sys.stderr,
            )


def check_combination(config: RunConfig) -> None:
    """Options that contradict each other."""
    if config.bus == "inline" and config.pace != "lockstep":
        raise Mistake(
            f"--pace {config.pace} with --bus inline: inline goes in lockstep, as fast as it can; "
            "use --bus embedded"
        )
    if config.junit:
        _check_junit(config.junit)
    if (config.flight, config.emulator) != (OURS, OURS):
        from gnss_hil.tools.run_config import sides

        changes = config.overrides
        own = {"policy": changes.policy, "navigator": changes.navigator, "option": changes.options}
        sides.check(config.flight, config.emulator, config.bus, own)


def _check_junit(path: Path) -> None:
    """A verdict that could not be written is told before the run, not after it."""
    if not path.absolute().parent.is_dir():
        raise Mistake(f"--junit {path}: no such folder {path.parent}")
    if path.is_dir():
        raise Mistake(f"--junit {path}: is a folder; name a file")
    if not os.access(path if path.exists() else path.absolute().parent, os.W_OK):
        raise Mistake(f"--junit {path}: cannot be written: Permission denied")


@contextmanager
def interruptible() -> Iterator[Any]:
    """A function that tells whether Ctrl-C or SIGTERM came; a second Ctrl-C ends at once."""
    came: list[int] = []

    def note(number, frame):
        came.append(number)
        if len(came) > 1:
            raise KeyboardInterrupt

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Recording:
    """Whether anything is on record: then the folder is kept, whatever happens."""

    recorder: Any = None

    @property
    def begun(self) -> bool:
        return self.recorder is not None and self.recorder.frames > 0


def _play(plan, config: RunConfig, folder, recording: _Recording):
    """The run itself: outcome, and digests by craft, made of the frames as they are recorded."""
    from gnss_hil.tools.live.display import open_display
    from gnss_hil.tools.recording.recorder import Recorder
    from gnss_hil.tools.recording.run_folder import LOG, TRUTH
    from gnss_hil.tools.results.run_digest import RunDigest, bus_names

    time = plan.scenario.time
    # What a program of somebody else's says goes to the same terminal, and must not be drawn over.
    strangers = {config.flight, config.emulator} - {OURS, EXTERNAL}
    plain = config.plain or bool(strangers)
    display = open_display(plan, folder / TRUTH, config.quiet, plain)
    with ExitStack() as stack:
        stop = stack.enter_context(interruptible())
        stack.callback(display.close)
        log = stack.enter_context((folder / LOG).open("wb")) if config.log else None
        digest = RunDigest(folder.path if config.log else None, plan.names, plan.codecs)
        stack.callback(digest.discard)
        recorder = Recorder(
            dict(zip(bus_names(plan.names), plan.codecs, strict=True)),
            time.start_ns,
            time.interval_ns,
            log,
            digest.feed,
        )
        recording.recorder = recorder
        stack.callback(recorder.flush)
        play = _play_inline if config.bus == "inline" else _play_processes
        outcome = play(plan, config, folder, recorder, display, stop)
        recorder.flush()
        return outcome, digest.finish()


def _play_inline(plan, config, folder, recorder, display, stop):
    from gnss_hil.emulator.journal import TruthLog
    from gnss_hil.emulator.truth import TRUTH as ROW
    from gnss_hil.tools.processes import inline
    from gnss_hil.tools.recording.run_folder import TRUTH

    with TruthLog(folder / TRUTH, ROW, plan.names) as truth:
        return inline.play(plan, recorder, truth, display, stop)


def _play_processes(plan, config, folder, recorder, display, stop):
    from gnss_hil.tools.processes import supervisor

    return supervisor.play(plan, config, folder, recorder, display, stop)


def _finish(plan, config: RunConfig, folder, outcome, digests) -> int:
    """Tables and summary; what it showed on stdout; the exit status."""
    from gnss_hil.tools.commands import report
    from gnss_hil.tools.recording.run_folder import naming
    from gnss_hil.tools.results import assemble, junit
    from gnss_hil.tools.results.text import missed, render

    with naming(folder.path):
        facts = facts_of(plan, config, outcome)
        summary = assemble.write(folder.path, facts, digests)
    print(render(summary))
    print(f"\nrun folder: {folder.path}", flush=True)
    lines = [outcome.failure] if outcome.failure else []
    if config.report:
        lines += report.draw(folder.path, facts, summary, digests)
    if config.junit:
        try:
            junit.write(config.junit, summary, lines)
        except OSError as error:
            lines.append(f"--junit {config.junit}: {error.strerror}")
    lines += [] if outcome.interrupted else missed(summary)
    for line in lines:
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return INTERRUPTED if outcome.interrupted else 1 if lines else 0


def facts_of(plan, config: RunConfig, outcome) -> dict[str, Any]:
    """What the run alone knows; the first part of summary.json."""
    scenario = plan.scenario
    interface, _, channel = config.bus.partition(":")
    simulated_s = outcome.epochs * scenario.time.epoch_interval_s
    clean = not outcome.unanswered and not outcome.interrupted and not outcome.failure

    def milliseconds(value):
        return None if value is None else float(f"{value * 1e3:.4g}")

    return {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "emulator": config.emulator,
        "policy": scenario.craft[0].flight.policy if config.flight == OURS else config.flight,
        "pace": config.pace,
        "bus": {"interface": interface, "channel": channel},
        "reproducible": config.pace == "lockstep" and clean,
        "interrupted": outcome.interrupted,
        "duration_s": simulated_s,
        "epoch_interval_s": scenario.time.epoch_interval_s,
        "epochs": outcome.epochs,
        "epochs_unanswered": outcome.unanswered,
        "real_time_factor": float(f"{simulated_s / outcome.wall_s:.4g}") if outcome.wall_s > 0 else None,
        "epoch_latency_ms": {
            "p50": milliseconds(outcome.latency_p50_s),
            "p99": milliseconds(outcome.latency_p99_s),
        },
        "mark_late_ms": milliseconds(outcome.mark_late_s),
        "latency_histogram": [list(bar) for bar in outcome.latency_histogram],
        "frames_sent": outcome.frames_sent,
        "expect": {name: limits.model_dump(exclude_none=True) for name, limits in scenario.expect.items()},
    }
