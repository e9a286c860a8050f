"""One run for each of several seeds: the same scenario on other draws, and a table of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.tools.common.errors import Failed
from gnss_hil.tools.processes.run_session import Interruptible, Ran, play
from gnss_hil.tools.recording.run_folder import write_json
from gnss_hil.tools.results.figures import figure, small
from gnss_hil.tools.results.text import judged, missed
from gnss_hil.tools.run_config.config import RunConfig

TABLE = "seeds.json"

OK, NOT_JUDGED = "ok", "-"
"""Verdicts of runs of which nothing is wrong."""

_COLUMNS = (
    ("fixes", ("fixes",)),
    ("first fix [s]", ("first_fix_s",)),
    ("satellites", ("converged", "satellites_tracked", "mean")),
    ("PDOP", ("converged", "pdop", "median")),
    ("error median [m]", ("converged", "position_error_m", "median")),
    ("rms", ("converged", "position_error_m", "rms")),
    ("p95", ("converged", "position_error_m", "p95")),
    ("max", ("converged", "position_error_m", "max")),
)
"""Figures of a craft in the table, and where they stand in its summary."""

_OVER_ALL = {"least": np.min, "mean": np.mean, "greatest": np.max}


def play_each(config: RunConfig, folder: Path, stop: Interruptible) -> Iterator[tuple[int, Ran | Failed]]:
    """A run of each seed in a folder of its own, in their order, until `stop` comes; why one never began."""
    for seed in config.seeds:
        changed = replace(config.overrides, seed=seed)
        try:
            ran = play(replace(config, overrides=changed, out=folder / f"seed-{seed}"), stop)
        except Failed as error:
            yield seed, error
            continue
        if ran is None:
            return
        yield seed, ran
        if ran.outcome.interrupted:
            return


def wrong(ran: Ran) -> list[str]:
    """What is wrong with a run: how it broke off, what its record lacks, expectations missed."""
    if ran.outcome.interrupted:
        return ["interrupted"]
    return [*([ran.outcome.failure] if ran.outcome.failure else []), *ran.faults, *missed(ran.summary)]


def rows(seed: int, ran: Ran, faults: Sequence[str]) -> Iterator[dict[str, Any]]:
    """A row for each craft, figures by column: those after convergence where there is a choice. Its verdict
    is what is wrong, else "ok", or "-" where the scenario expects nothing."""
    verdict = "; ".join(faults) or (OK if judged(ran.summary) else NOT_JUDGED)
    for craft, figures in ran.summary["craft"].items():
        values = {name: _at(figures, path) for name, path in _COLUMNS}
        yield {"seed": seed, "craft": craft, **values, "verdict": verdict}


def _at(figures: Mapping[str, Any], path: Sequence[str]) -> float | int | None:
    found: Any = figures
    for key in path:
        found = found[key]
    return found


def table(found: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """The rows as text with a heading, and over all seeds of each craft."""
    names = [name for name, _ in _COLUMNS]
    crafts = list(dict.fromkeys(row["craft"] for row in found))
    cells = [["seed", "craft", *names, "verdict"]]
    for row in found:
        verdict = row["verdict"] if row["verdict"] in (OK, NOT_JUDGED) else "FAILED"
        cells.append([str(row["seed"]), row["craft"], *(_shown(row[name]) for name in names), verdict])
    for craft in crafts if len(found) > len(crafts) else ():
        mine = [row for row in found if row["craft"] == craft]
        for word, over in _OVER_ALL.items():
            columns = ([row[name] for row in mine if row[name] is not None] for name in names)
            cells.append([word, craft, *(_shown(float(over(c))) if c else "-" for c in columns), ""])
    return cells


def _shown(value: float | int | None) -> str:
    return figure(value) if value is None or isinstance(value, int) else small(value)


def write(found: Sequence[Mapping[str, Any]], folder: Path) -> Path:
    """The table as JSON, beside the runs."""
    path = folder / TABLE
    write_json(path, {"runs": list(found)})
    return path
