"""What a replay leaves: a recording of both sides, or a run folder with a report of it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording import provenance
from gnss_hil.tools.recording.formats.convert import convert
from gnss_hil.tools.recording.formats.recording import Recording, format_of
from gnss_hil.tools.recording.provenance import INPUTS
from gnss_hil.tools.recording.recorder import Recorder
from gnss_hil.tools.recording.run_folder import SCENARIO, TRUTH, RunFolder, naming, vehicle_name
from gnss_hil.tools.replay.players import Keep, Played
from gnss_hil.tools.replay.recorded_run import RecordedRun
from gnss_hil.tools.replay.source import Source, scenario_of
from gnss_hil.tools.results import assemble
from gnss_hil.tools.results.text import REPLAY_OF
from gnss_hil.tools.run_config.config import OTHER_SIDE, OURS, ReplayConfig


def check(out: Path | None, report: Path | None, force: bool, source: Source) -> None:
    """Mistake if what is to be left cannot be, before anything is played."""
    if out and report:
        raise Mistake("--out with --report: the folder of --report has the recording, bus.log")
    if out:
        format_of(out)
        if out.exists() and (not force or out.is_dir()):
            raise Mistake(f"--out {out}: exists{'' if out.is_dir() else '; --force overwrites it'}")
        if out.exists() and out.samefile(source.recorded.recording.path):
            raise Mistake(f"--out {out}: is what would be read; name another file")
        if not out.absolute().parent.is_dir():
            raise Mistake(f"--out {out}: no such folder {out.parent}")
    if report and not source.alone:
        raise Mistake(f"--report {report}: only for a run folder of one craft")


@contextmanager
def recorder(recorded: RecordedRun, path: Path | None) -> Iterator[Keep]:
    """Takes epochs into a candump log at `path`, in canonical order: emulator, then flight software."""
    if path is None:
        yield lambda number, emulator, flight: None
        return
    with naming(path), path.open("wb") as log:
        record = Recorder({recorded.bus: recorded.codec}, recorded.start_ns, recorded.interval_ns, log)

        def keep(number: int, emulator: FrameBatch, flight: FrameBatch) -> None:
            record.add(0, number, concat((emulator, flight)))

        try:
            yield keep
        finally:
            record.flush()
            if not record.frames:  # nothing came of it
                path.unlink()


@contextmanager
def recording_at(recorded: RecordedRun, out: Path | None) -> Iterator[Keep]:
    """Takes epochs into a recording of any format."""
    if out is None or out.suffix.lower() == ".log":
        with recorder(recorded, out) as keep:
            yield keep
        return
    draft = out.with_name(f".{out.name}.log")
    try:
        with recorder(recorded, draft) as keep:
            yield keep
        if draft.exists():
            with naming(out):
                convert(Recording(draft), out)
    finally:
        draft.unlink(missing_ok=True)


def make_folder(path: Path, source: Source, truth: bool) -> RunFolder:
    """A run folder that describes what is replayed; `truth` belongs to a recorded emulator only."""
    folder = RunFolder(path, "--report")
    run, scenario = scenario_of(source)
    names = [craft.name for craft in scenario.craft]
    shutil.copy(run / SCENARIO, folder / SCENARIO)
    if (run / INPUTS).is_dir():
        shutil.copytree(run / INPUTS, folder / INPUTS)
    shutil.copy(source.vehicle or run / vehicle_name(names, 0), folder / vehicle_name(names, 0))
    if truth and (run / TRUTH).exists():
        shutil.copy(run / TRUTH, folder / TRUTH)
    return folder


def about_of(config: ReplayConfig, command: str) -> dict[str, Any]:
    """What is replayed, by whom, where and when."""
    return {**provenance.program(), "command": command, "host": provenance.host(),
            "begun_utc": provenance.now(), "flight": config.flight, "emulator": config.emulator,
            "settings": {}, "inputs": []}  # fmt: skip


def facts_of(
    source: Source, config: ReplayConfig, played: Played, about: Mapping[str, Any],
    lacking: Sequence[str] = (),
) -> dict[str, Any]:  # fmt: skip
    """What the replay alone knows.

    lacking   lines on what the recording lacks, and has besides
    """
    (run, scenario), latency = scenario_of(source), played.tally.latency
    interval_s = source.recorded.interval_ns / 1e9
    recorded = f"{REPLAY_OF}{run}"
    ours = config.flight == OURS
    policy = (config.policy or scenario.craft[0].flight.policy) if ours else config.flight
    return assemble.facts_of(
        scenario,
        played.epochs,
        emulator=recorded if config.only == "emulator" else config.emulator,
        policy=recorded if config.only == "flight" else policy,
        pace=config.pace,
        bus=assemble.bus_of(config.bus),
        reproducible=config.pace == "lockstep" and played.complete and not played.tally.unanswered,
        interrupted=not played.complete,
        ended=assemble.COMPLETE if played.complete else assemble.INTERRUPTED,
        failure="",
        remarks=[*lacking],
        **({"epochs_planned": played.epochs} if played.complete else {}),
        about=about,
        epoch_interval_s=interval_s,
        epochs_unanswered=played.tally.unanswered,
        real_time_factor=assemble.real_time_factor(played.epochs * interval_s, played.wall_s),
        epoch_latency_ms=assemble.latency_ms(latency.percentile_s(50), latency.percentile_s(99)),
        latency_histogram=[list(bar) for bar in latency.histogram()],
    )


def account(config: ReplayConfig, played: Played) -> list[str]:
    """What a replay showed, in lines."""
    wall, sent = f"{played.wall_s:.1f} s", so_many(played.sent, "frame")
    if config.only is None:
        return [f"replayed    {sent} in {wall}; {played.heard} heard from others"]
    epochs = so_many(played.epochs, "epoch")
    lines = [f"replayed    {epochs} in {wall}: {sent} sent, {played.heard} heard"]
    if config.only == "emulator" and config.pace == "lockstep":
        lines.append(f"unanswered  {so_many(played.tally.unanswered, 'epoch')}")
    lines.append(f"{OTHER_SIDE[config.only]:<11} {played.comparison.result}")
    return lines
