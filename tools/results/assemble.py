"""From what a run left behind to its tables and summary; the same code after a run and long after it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.codec import Codec, codec
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.config.named_files import anchor
from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.recording import fingerprints
from gnss_hil.tools.recording.run_folder import FACTS, FAULTS, SCENARIO, SUMMARY, TRUTH, write_json
from gnss_hil.tools.results import fault_verdicts, tables, time_offset, truth
from gnss_hil.tools.results.summary import build

COMPLETE, INTERRUPTED, FAILED = "complete", "interrupted", "failed"
DIED = "it died before it could say how it ended"


class _Bus(BaseModel):
    interface: str | None
    channel: str | None


class _Latency(BaseModel):
    p50: float | None
    p99: float | None


class _Facts(BaseModel):
    """What run.json has to hold for a summary; null where a run died before it was known.

    ended    COMPLETE, INTERRUPTED, FAILED or, null, while it goes on and where it died
    failure  why it broke off
    faults   what was armed on each craft's bus
    bench_frames_refused_in   by craft: epoch, how many
    record   `gnss_hil.tools.recording.fingerprints`, when it had ended
    about    `gnss_hil.tools.recording.provenance`, and what was asked for
    """

    scenario: str
    seed: int
    policy: str
    pace: str | None
    bus: _Bus
    reproducible: bool
    interrupted: bool
    duration_s: float
    epoch_interval_s: Annotated[float, Field(gt=0)]
    epochs: int
    epochs_unanswered: int | None
    real_time_factor: float | None
    epoch_latency_ms: _Latency
    mark_late_ms: float | None = None
    frames_sent: int | None
    latency_histogram: list[tuple[float, int]] = []
    remarks: list[str] = []
    faults: list[dict[str, Any]] = []
    bench_frames_refused_in: dict[str, list[tuple[int, int]]] = {}
    ended: str | None = INTERRUPTED
    failure: str = ""
    epochs_planned: int | None = None
    about: dict[str, Any] = {}
    record: dict[str, dict[str, Any]] = {}
    expect: dict[str, dict[Literal["min", "max", "after_s"], float]]


def write(
    folder: Path, facts: Mapping[str, Any], digests: Mapping[str, Digest], changed: Sequence[str] = ()
) -> dict[str, Any]:
    """Tables, run.json and summary.json of a folder; the summary.

    changed   lines on files that are not as the run left them: remarks of the summary, not of the run
    """
    stream = truth.read(folder / TRUTH) if (folder / TRUTH).exists() else None
    tables.write_fixes_and_truth(folder, digests, stream, facts.get("bench_frames_refused_in", {}))
    summary = build(facts, digests, stream) | {"faults": _faults(folder)}
    summary["remarks"] = [*facts.get("remarks", []), *changed, *_of_another_time(digests, stream)]
    write_json(folder / FACTS, facts)
    write_json(folder / SUMMARY, summary)
    return summary


def _of_another_time(digests: Mapping[str, Digest], known: truth.Truth | None) -> Iterator[str]:
    if known is None:
        return
    for name in digests.keys() & set(known.craft):
        yield from time_offset.remark(name, digests[name].fixes, known.of(name))


def since_the_run(folder: Path) -> Iterator[str]:
    """A line for each file of a run folder that is not as its run left it."""
    for line in fingerprints.changed(folder, (read_facts(folder) or {}).get("record", {})):
        yield f"{folder}: {line}"


def new_remarks(facts: Mapping[str, Any], summary: Mapping[str, Any]) -> list[str]:
    """What a summary remarks on beside what its run did."""
    return [line for line in summary["remarks"] if line not in facts.get("remarks", [])]


def _faults(folder: Path) -> list[dict[str, Any]]:
    """What became of the run's faults, in their order; beside it their table."""
    if not (folder / FAULTS).exists():
        return []
    scenario, _ = read_scenario(folder)
    judged = fault_verdicts.judge(folder, scenario.fault, antennas(folder))
    fault_verdicts.write(folder, judged)
    return fault_verdicts.rows(judged)


def read_facts(folder: Path) -> dict[str, Any] | None:
    """What the run noted of itself; None if it died before. Mistake if the file is damaged."""
    path = folder / FACTS
    if not path.exists():
        return None
    text = path.read_bytes()
    try:
        _Facts.model_validate_json(text, strict=True)
        return json.loads(text)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"]))
        raise Mistake(f"{path}: is damaged: {where}{': ' if where else ''}{fault['msg']}") from None


def read_scenario(folder: Path) -> tuple[Scenario, list[Codec]]:
    """The scenario of a run folder and the codec of each craft's bus."""
    path = folder / SCENARIO
    document = scenarios.read(path)
    anchor(document, folder)
    scenario = scenarios.parse(document, str(path))
    found = [vehicle.load(scenarios.vehicle_path(craft, path)) for craft in scenario.craft]
    return scenario, [codec(v.antennas) for v in found]


def antennas(folder: Path) -> dict[str, tuple[str, ...]]:
    """Names of the antennas of each craft of a run folder."""
    scenario, _ = read_scenario(folder)
    path = folder / SCENARIO
    return {one.name: tuple(vehicle.load(scenarios.vehicle_path(one, path)).names) for one in scenario.craft}


def after_a_crash(facts: Mapping[str, Any] | None, scenario: Scenario, epochs: int) -> dict[str, Any]:
    """What is known of a run that noted how it ended, or did not; epochs as its log has them."""
    if facts is None:
        return facts_of(scenario, epochs)
    if facts.get("ended", COMPLETE) is not None:
        return dict(facts)
    return {**facts, "epochs": epochs, "duration_s": epochs * facts["epoch_interval_s"],
            "failure": facts.get("failure") or DIED, "ended": FAILED, "interrupted": True}  # fmt: skip


def facts_of(scenario: Scenario, epochs: int, **noted: Any) -> dict[str, Any]:
    """What a run of some epochs notes of itself. What is not noted is as after a crash: by the scenario, or
    unknown, null."""
    interval_s = noted.get("epoch_interval_s", scenario.time.epoch_interval_s)
    return {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "emulator": None,
        "policy": scenario.craft[0].flight.policy,
        "pace": None,
        "bus": bus_of(None),
        "reproducible": False,
        "interrupted": True,
        "duration_s": epochs * interval_s,
        "epoch_interval_s": interval_s,
        "ended": FAILED,
        "failure": DIED,
        "epochs": epochs,
        "epochs_planned": scenario.time.epochs,
        "epochs_unanswered": None,
        "real_time_factor": None,
        "epoch_latency_ms": latency_ms(None, None),
        "mark_late_ms": None,
        "latency_histogram": [],
        "frames_sent": None,
        "faults": [],
        "remarks": [],
        "expect": {name: limits.model_dump(exclude_none=True) for name, limits in scenario.expect.items()},
    } | noted


def bus_of(spec: str | None) -> dict[str, str | None]:
    """INTERFACE:CHANNEL in its two parts."""
    interface, _, channel = (spec or "").partition(":")
    return {"interface": interface, "channel": channel} if spec else {"interface": None, "channel": None}


def latency_ms(p50_s: float | None, p99_s: float | None) -> dict[str, float | None]:
    """Percentiles of the epochs' latency [s] as figures [ms]."""
    return {"p50": milliseconds(p50_s), "p99": milliseconds(p99_s)}


def milliseconds(seconds: float | None) -> float | None:
    """A duration [s] as a figure [ms]."""
    return None if seconds is None else float(f"{seconds * 1e3:.4g}")


def real_time_factor(simulated_s: float, wall_s: float) -> float | None:
    return float(f"{simulated_s / wall_s:.4g}") if wall_s > 0 else None
