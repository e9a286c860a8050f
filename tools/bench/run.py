"""`gnss_hil.run`: a scenario played from a program, by the code of `gnss-hil run`."""

from __future__ import annotations

import gc
import shlex
import signal
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gnss_hil.dbc.process.command_line import Value
from gnss_hil.tools.bench.arguments import PathName, Program, words
from gnss_hil.tools.bench.errors import BenchError, as_bench_errors
from gnss_hil.tools.bench.record import Run
from gnss_hil.tools.command_line.main import COMMANDS, PROGRAM, parser_of
from gnss_hil.tools.commands import run as command
from gnss_hil.tools.commands.report import draw
from gnss_hil.tools.processes import run_session
from gnss_hil.tools.run_config.combination import check_combination
from gnss_hil.tools.run_config.config import RunConfig


def run(
    scenario: PathName = "soyuz",
    *,
    duration: float | str | None = None,
    interval: float | str | None = None,
    seed: int | None = None,
    faults: Sequence[PathName] = (),
    bus: str | None = None,
    pace: str | None = None,
    flight: Program | None = None,
    emulator: Program | None = None,
    vehicle: PathName | None = None,
    policy: str | None = None,
    navigator: str | None = None,
    options: Mapping[str, Value] | None = None,
    autonomous: str | None = None,
    on: Sequence[str] = (),
    off: Sequence[str] = (),
    set: Mapping[str, Any] | None = None,
    nav: Sequence[PathName] = (),
    sp3: Sequence[PathName] = (),
    obs: PathName | None = None,
    reference: PathName | None = None,
    ionosphere_free: bool = False,
    out: PathName | None = None,
    log: bool = True,
    report: bool = True,
    progress: bool = False,
    check: bool = True,
) -> Run:
    """Play a scenario from end to end, as `gnss-hil run` does, and return its record.

    scenario         shipped one by name, or a .toml file
    duration, interval   simulated time, and time between epochs: [s], or text such as "10m"
    seed             of all random draws
    faults           what goes wrong: one-liners, "rx2 off @2m+30s", and files of faults, Path("faults.toml")
    bus              "embedded" (default, processes on a bus of our own), "inline" (this process, fastest; for
                     our own two sides), "socketcan:vcan0" or any python-can INTERFACE:CHANNEL
    pace             "lockstep" (default), "realtime", "x10"
    flight           another flight software: a command line or its words, ["./my-fsw", "--arg"]; "external":
                     one that you start yourself. It finds GNSS_HIL_BUS, GNSS_HIL_VEHICLE and GNSS_HIL_CRAFT
    emulator         another emulator or receiver, likewise
    vehicle          vehicle file, or name of a shipped one, instead of the scenario's
    policy, navigator, options   of our flight software
    autonomous       rule by which receivers left alone search
    on, off          error models switched, "all" among them
    set              any keys of the scenario by their paths: {"craft.0.orbit.altitude_km": 500}; text is read
                     as `--set` reads it
    nav, sp3, obs, reference, ionosphere_free   as the options of these names
    out              run folder (default runs/<scenario>-<date>-<time>), which must not exist or be empty
    log              bus.log and channels.parquet, which very long runs may do without
    report           draw report.html now; `Run.report` draws it later
    progress         say on stderr, now and then, where the run stands
    check            a run that breaks off, or whose record is not the flight, is an error

    What was left None is as the scenario or the command line has it. Expectations of the scenario that are
    missed are no error: `Run.missed` has them.

    Raises BenchError, with one line a fault, before anything starts for a mistake; for a failed run with
    `folder`, in which all is that was recorded. KeyboardInterrupt after Ctrl-C, once the run folder is
    written. May be called from any thread.
    """
    asked = {**locals(), "options": options or {}, "set": set or {}}
    said = [*words(scenario, asked), *([] if log else ["--no-log"])]
    shown = ["--plain", "--no-report", *([] if progress else ["--quiet"])]
    played = _play(_config(said, shown, out), report)
    gc.collect()  # worlds are cycles of few objects and large arrays: left alone they pile up, 1.4 MB a run
    if check and played.failures:
        raise BenchError("\n".join(played.failures), 1, played.folder)
    return played


def _config(said: Sequence[str], shown: Sequence[str], out: PathName | None) -> RunConfig:
    """What the command line would make of it. `said` alone is on record: it repeats the run."""
    told = Namespace(command_line=shlex.join([PROGRAM, "run", *said]))
    place = [] if out is None else [f"--out={Path(out).absolute()}"]
    with as_bench_errors():
        parser = parser_of(COMMANDS["run"])
        config = command.config_of(parser.parse_args([*said, *shown, *place], told))
        check_combination(config)
    return config


def _play(config: RunConfig, report: bool) -> Run:
    stop = run_session.Interruptible()
    with as_bench_errors(config.out):
        ran = run_session.play(config, stop, say=lambda remark: None)
    if stop():
        signal.raise_signal(stop.status - 128)  # what the program was sent, now that its record is written
    if ran is None or ran.outcome.interrupted:
        raise BenchError("interrupted", 1, None if ran is None else ran.folder)
    failures = [*([ran.outcome.failure] if ran.outcome.failure else []), *ran.faults]
    if report:
        failures += draw(ran.folder, ran.facts, ran.summary, ran.digests, told=False)
    notes = dict.fromkeys([*ran.facts["remarks"], *ran.notes])
    return Run(ran.folder.absolute(), failures=tuple(failures), notes=tuple(notes))
