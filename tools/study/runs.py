"""The runs of a study: each a plan made from one scenario and one change, several at a time."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from typing import TextIO

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config.config import Overrides
from gnss_hil.tools.run_config.plan import Plan, make
from gnss_hil.tools.study.factors import ALONE
from gnss_hil.tools.study.two_craft import Errors, play

TURN_DEG = 60.0
"""Roll of the second craft where it shall see other satellites, or the same on other antennas."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run: a scenario with one factor on, all others off, and its second craft turned or not."""

    scenario: str
    factor: str
    turned: bool
    duration_s: float | None
    interval_s: float | None

    def plan(self) -> Plan:
        """The run's plan; Mistake, ScenarioError or VehicleError if there is none."""
        overrides = Overrides(
            duration_s=self.duration_s, interval_s=self.interval_s,
            on=() if self.factor == ALONE else (self.factor,), off=("all",),
            attitudes={1: {"mode": "offset", "roll_deg": TURN_DEG}} if self.turned else {},
        )  # fmt: skip
        made = make(self.scenario, overrides, refuse_overload=False)
        if len(made.names) != 2:
            raise Mistake(f"{self.scenario}: {len(made.names)} craft; a study of factors needs two")
        return made

    def about(self) -> str:
        """What all runs of the study have in common."""
        time = self.plan().scenario.time
        return f"Scenario {self.scenario}, {so_many(time.epochs, 'epoch')} of {time.epoch_interval_s:g} s."


def _played(job: Job) -> Errors:
    return play(job.plan())


def play_all(jobs: Sequence[Job], at_a_time: int, stream: TextIO | None) -> list[Errors]:
    """What the jobs show, in their order; a line for each that is done."""
    found: dict[int, Errors] = {}
    with ProcessPoolExecutor(min(at_a_time, os.cpu_count() or 1)) as pool:
        try:
            waiting = {pool.submit(_played, job): k for k, job in enumerate(jobs)}
            for done, future in enumerate(as_completed(waiting), 1):
                place = waiting[future]
                found[place] = future.result()
                if stream is not None:
                    turned = ", second craft turned" if jobs[place].turned else ""
                    stream.write(f"{done} of {len(jobs)}: {jobs[place].factor}{turned}\n")
                    stream.flush()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [found[place] for place in range(len(jobs))]
