"""`gnss-hil emulate`: the emulator alone, of a scenario changed as `run` changes it."""

from __future__ import annotations

import argparse
from argparse import Namespace

from gnss_hil.emulator import __main__ as emulator
from gnss_hil.tools.command_line.arguments import add_scenario, add_truth_changes, overrides_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_scenario(parser)
    add_truth_changes(parser)
    emulator.add_bus_arguments(parser)


def run(arguments: Namespace) -> int:
    from gnss_hil.tools.run_config import plan

    def world(session: int, pace: float | None):
        found = plan.resolve(arguments.scenario, overrides_of(arguments))
        scenario = found.scenario
        period_s = None if pace is None else scenario.time.epoch_interval_s / pace
        made = found.world(session, period_s)
        plan.check_load(scenario, plan.budgets_of(scenario, found.vehicles, made))
        return scenario, made

    return emulator.run(arguments, world)
