"""A run from its plan to its folder: played, recorded, decoded, put into tables and summary."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.dbc.process.shutdown import Stop
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.faults import ledger
from gnss_hil.tools.common.errors import PROGRAM, Mistake
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.live.display import Display, open_display
from gnss_hil.tools.processes import overload
from gnss_hil.tools.processes import reference as judging
from gnss_hil.tools.processes.outcome import Outcome
from gnss_hil.tools.recording import account, fingerprints, provenance
from gnss_hil.tools.recording.recorder import Recorder
from gnss_hil.tools.recording.run_folder import (
    FACTS,
    FAULTS,
    LOG,
    TRUTH,
    RunFolder,
    default_path,
    naming,
    write_json,
)
from gnss_hil.tools.results import assemble
from gnss_hil.tools.results.fault_text import clipped, idle
from gnss_hil.tools.results.run_digest import RunDigest, bus_names
from gnss_hil.tools.run_config import plan as plans
from gnss_hil.tools.run_config import sides
from gnss_hil.tools.run_config.config import EXTERNAL, OURS, RunConfig
from gnss_hil.tools.run_config.plan import Plan


@dataclass(frozen=True, slots=True, eq=False)
class Ran:
    """What a run left.

    folder   with tables and summary in it
    facts    what the run alone knows
    digests  by craft
    faults   why the record is not the flight;  notes  what was refused or late and changed nothing
    """

    folder: Path
    facts: Mapping[str, Any]
    summary: Mapping[str, Any]
    digests: Mapping[str, Digest]
    outcome: Outcome
    faults: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def on_stderr(text: str) -> None:
    """A remark on the plan, for who sits at a command line."""
    print(f"{PROGRAM}: {text}", file=sys.stderr)


def play(
    config: RunConfig, stop: Interruptible | None = None, say: Callable[[str], None] = on_stderr
) -> Ran | None:
    """Plays what is configured; None if it was interrupted before it began, which leaves nothing.

    say   is told of what is odd about the plan, before it begins; it is in the facts too
    """
    reference = config.overrides.reference if config.emulator != OURS else None
    plan = plans.make(
        config.scenario, replace(config.overrides, reference=None) if reference else config.overrides
    )
    if plan.world.faults and config.emulator != OURS:
        kind = plan.scenario.fault[0].kind
        raise Mistake(f"fault: {kind}: our emulator applies faults; --emulator {config.emulator} has none")
    if reference:
        judging.check(plan.scenario, reference)
    for remark in plan.remarks:
        say(remark)
    _check_bus(plan, config)
    folder = RunFolder(config.out or default_path(plan.scenario.name))
    recording = _Recording()
    begun: dict[str, Any] = {}
    try:
        with naming(folder.path):
            about = _about(plan, config, folder.describe(plan.scenario, plan.vehicle_texts))
            begun = _facts(plan, config, about, NOT_YET)
            write_json(folder / FACTS, begun)
            outcome, digests = _play(plan, config, folder, recording, stop or Interruptible())
    except BaseException as error:
        if recording.begun:
            _note_death(folder, begun, error)
            print(f"run folder with everything up to here: {folder.path}", file=sys.stderr)
        else:
            folder.discard()
        raise
    if not outcome.epochs:  # interrupted before it began
        folder.discard()
        return None
    judged, remarks = [], []
    with naming(folder.path):
        if reference:
            judged, remarks = judging.write_truth(folder, plan.scenario, reference, digests[plan.names[0]])
            about["inputs"].append(provenance.taken(reference, folder.path, len(about["inputs"])))
        about["ended_utc"] = provenance.now()
        facts = _facts(plan, config, about, outcome)
        facts["record"] = fingerprints.of_record(folder.path, plan.names)
        summary = assemble.write(folder.path, facts, digests)
    whole = not outcome.failure and not outcome.interrupted
    told, disturbed = _told(plan, outcome, digests), bool(plan.world.faults)
    return Ran(
        folder.path,
        facts,
        summary,
        digests,
        outcome,
        (
            *judged,
            *_unanswered(config, outcome),
            *(line for row in told for line in account.faults(*row, disturbed)),
        )
        if whole
        else (),
        (
            *remarks,
            *(line for row in told for line in account.notes(*row, disturbed)),
            *(_by_one_carrier(plan, digests) if config.flight == OURS else ()),
            *(_empty_skies(summary) if config.emulator == OURS else ()),
            *overload.notes(config.pace, plan.scenario.time.epoch_interval_s, outcome),
            *idle(summary),
            *clipped(summary),
            *assemble.new_remarks(facts, summary),
        ),
    )


def _note_death(folder: RunFolder, begun: Mapping[str, Any], error: BaseException) -> None:
    """In run.json, why a run ended early, if it can be said there: the disk may be what is full."""
    why = f"{error.filename}: {error.strerror}" if isinstance(error, OSError) else str(error)
    with suppress(OSError):
        write_json(folder / FACTS, {**begun, "failure": why.partition("\n")[0]})


def _by_one_carrier(plan: Plan, digests: Mapping[str, Digest]) -> Iterator[str]:
    """A line for each craft that was to make its fixes of two carriers and made some of one."""
    for craft, flight in zip(plan.names, plan.flights, strict=True):
        fixes = digests[craft].fixes
        alone = int((fixes["valid"] & (fixes["satellites_paired"] == 0)).sum())
        if flight.options.ionosphere_free and alone:
            valid = so_many(int(fixes["valid"].sum()), "fix", "fixes")
            yield f"craft {craft}: {alone} of {valid} by one carrier: too few pairs"


def _empty_skies(summary: Mapping[str, Any]) -> Iterator[str]:
    """A line for each craft that had no satellite in view, ever or at times: nothing else may tell why. Only
    our emulator says which are."""
    for craft, figures in summary["craft"].items():
        seen = figures["satellites_visible"]
        if seen["max"] == 0:
            yield (
                f"craft {craft}: no satellite was in view in any epoch: are sky, orbit, antennas and their "
                "gains as meant?"
            )
        elif seen["min"] == 0:
            yield f"craft {craft}: there were epochs without a satellite in view"


def _unanswered(config: RunConfig, outcome: Outcome) -> tuple[str, ...]:
    """In lockstep every epoch has its answer; at a pace one may come late."""
    if config.pace != "lockstep" or not outcome.unanswered:
        return ()
    many = so_many(outcome.unanswered, "epoch")
    return (f"{many} of {outcome.epochs} not answered in time: the run is not reproducible",)


def _told(plan: Plan, outcome: Outcome, digests: Mapping[str, Digest]) -> list[account.Told]:
    """Of each craft on a bus: what was heard there, what the sides counted, what is decoded of it."""
    rows = []
    for craft, heard, counted in zip(plan.names, outcome.heard, outcome.counted, strict=False):
        fixes = digests[craft].fixes
        rejected = digests[craft].counters.rejected
        disorder = rejected[Verdict.REPEATED.name] + rejected[Verdict.WRONG_SEQUENCE.name]
        decoded = account.Decoded(len(fixes["t_ns"]), int(fixes["valid"].sum()), disorder)
        whole = not outcome.failure and not outcome.interrupted
        rows.append((craft, heard, counted if whole else account.Counted(), decoded))
    return rows


def _check_bus(plan: Plan, config: RunConfig) -> None:
    """Mistake if the craft do not fit on the bus, or others are on it."""
    if config.bus in ("inline", "embedded"):
        return
    if len(plan.names) > 1:
        raise Mistake(f"--bus {config.bus}: each of {len(plan.names)} craft has its own bus; use embedded")
    if not config.bus.startswith("embedded:"):
        from gnss_hil.tools.processes.bus_tap import check_bus

        awaited = sides.awaited(plan.codecs[0], config.flight, config.emulator)
        check_bus(config.bus, plan.codecs[0], awaited)


class Interruptible(Stop):
    """A `Stop` at whose second signal the run ends at once, its processes with it."""

    def _again(self, number: int) -> None:
        raise KeyboardInterrupt


class _Recording:
    """Whether anything is on record: then the folder is kept, whatever happens."""

    recorder: Recorder | None = None

    @property
    def begun(self) -> bool:
        return self.recorder is not None and self.recorder.frames > 0


def _play(
    plan: Plan, config: RunConfig, folder: RunFolder, recording: _Recording, stop: Interruptible
) -> tuple[Outcome, dict[str, Digest]]:
    """The run itself: outcome, and digests by craft, made of the frames as they are recorded."""
    time = plan.scenario.time
    # What another's program prints goes to the same terminal, and must not be drawn over.
    foreign = {config.flight, config.emulator} - {OURS, EXTERNAL}
    display = open_display(plan, folder / TRUTH, config.quiet, config.plain or bool(foreign))
    with ExitStack() as stack:
        stack.enter_context(stop)
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
        way = _play_inline if config.bus == "inline" else _play_processes
        outcome = way(plan, config, folder, recorder, display, stop)
        recorder.flush()
        return outcome, digest.finish()


def _play_inline(
    plan: Plan,
    config: RunConfig,
    folder: RunFolder,
    recorder: Recorder,
    display: Display,
    stop: Interruptible,
) -> Outcome:
    from gnss_hil.emulator.journal import FaultLog, TruthLog
    from gnss_hil.emulator.truth import TRUTH as ROW
    from gnss_hil.tools.processes import inline

    with (
        TruthLog(folder / TRUTH, ROW, plan.names) as truth,
        FaultLog(folder / FAULTS, plan.world.faults) as fates,
    ):
        return inline.play(plan, recorder, truth, fates, display, stop)


def _play_processes(
    plan: Plan,
    config: RunConfig,
    folder: RunFolder,
    recorder: Recorder,
    display: Display,
    stop: Interruptible,
) -> Outcome:
    from gnss_hil.tools.processes import supervisor

    return supervisor.play(plan, config, folder, recorder, display, stop)


NOT_YET = Outcome(0, 0, 0.0, None, None, None)
"""Of a run that has only begun."""


def _about(plan: Plan, config: RunConfig, inputs: list[dict[str, Any]]) -> dict[str, Any]:
    """What is played, by whom, where and when."""
    path = scenarios.find(config.scenario)
    return {
        **provenance.program(),
        "command": config.command,
        "host": provenance.host(),
        "begun_utc": provenance.now(),
        "scenario": {"file": str(path.absolute()), "sha256": provenance.sha256(path)},
        "flight": config.flight,
        "emulator": config.emulator,
        "settings": provenance.settings(plan.scenario),
        "inputs": inputs,
    }


def _ended(outcome: Outcome) -> str | None:
    if outcome is NOT_YET:
        return None
    if outcome.interrupted:
        return assemble.INTERRUPTED
    return assemble.FAILED if outcome.failure else assemble.COMPLETE


def _facts(plan: Plan, config: RunConfig, about: Mapping[str, Any], outcome: Outcome) -> dict[str, Any]:
    """What the run alone knows; the first part of summary.json."""
    scenario = plan.scenario
    clean = not outcome.unanswered and not outcome.interrupted and not outcome.failure
    clean &= all(account.reproducible(heard) for heard in outcome.heard)
    simulated_s = outcome.epochs * scenario.time.epoch_interval_s
    return assemble.facts_of(
        scenario,
        outcome.epochs,
        about=about,
        ended=_ended(outcome),
        failure=outcome.failure,
        emulator=config.emulator,
        policy=scenario.craft[0].flight.policy if config.flight == OURS else config.flight,
        pace=config.pace,
        bus=assemble.bus_of(config.bus),
        reproducible=config.pace == "lockstep" and clean and outcome is not NOT_YET,
        interrupted=outcome.interrupted,
        epochs_unanswered=outcome.unanswered,
        real_time_factor=assemble.real_time_factor(simulated_s, outcome.wall_s),
        epoch_latency_ms=assemble.latency_ms(outcome.latency_p50_s, outcome.latency_p99_s),
        mark_late_ms=assemble.milliseconds(outcome.mark_late_s),
        latency_histogram=[list(bar) for bar in outcome.latency_histogram],
        frames_sent=outcome.frames_sent,
        faults=[ledger.about(one) for one in plan.world.faults],
        remarks=[*plan.remarks, *overload.notes(config.pace, scenario.time.epoch_interval_s, outcome)],
        bench_frames_refused=sum(sum(heard.refused.values()) for heard in outcome.heard),
        bench_frames_refused_in={
            name: [list(one) for one in sorted(heard.refused_in.items())]
            for name, heard in zip(plan.names, outcome.heard, strict=False)
            if heard.refused_in
        },
        time_marks_refused=sum(heard.refused_marks for heard in outcome.heard),
        fixes_flown={name: told.fixes for name, told in zip(plan.names, outcome.counted, strict=False)},
        answers_late=sum(heard.late for heard in outcome.heard),
    )
