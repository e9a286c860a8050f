"""The error models there are: the only list of them.

To add one: a file in this room with its `ROW` (see `base`), its name in the imports and the table below, and
whatever its row `shows` is tested. Scenario keys, `--on` and `--off`, help and documents follow.
"""

from __future__ import annotations

from collections.abc import Mapping

from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.error_models import (
    attitude_error,
    carrier_noise,
    clock_instability,
    code_bias,
    code_noise,
    cycle_slips,
    data_collection,
    doppler_noise,
    ephemeris_error,
    interchannel_bias,
    ionosphere,
    jamming,
    link_budget,
    loss_of_lock,
    multipath,
    onboard_clock,
    phase_windup,
    receive_pattern,
    satellite_clock_error,
    shadowing,
    transmit_pattern,
)
from gnss_hil.emulator.error_models.base import Row

FACTORS = table(
    code_noise.ROW,
    carrier_noise.ROW,
    doppler_noise.ROW,
    ephemeris_error.ROW,
    satellite_clock_error.ROW,
    code_bias.ROW,
    ionosphere.ROW,
    clock_instability.ROW,
    interchannel_bias.ROW,
    cycle_slips.ROW,
    loss_of_lock.ROW,
    phase_windup.ROW,
    data_collection.ROW,
    attitude_error.ROW,
    onboard_clock.ROW,
    transmit_pattern.ROW,
    receive_pattern.ROW,
    link_budget.ROW,
    jamming.ROW,
    shadowing.ROW,
    multipath.ROW,
)
"""By name, in the order in which they are listed and joined."""


def of_scope(scope: str) -> dict[str, Row]:
    """The rows that belong to the sky, or to each craft."""
    return {name: row for name, row in FACTORS.items() if row.scope == scope}


def of_all(scope: str, named: Mapping[str, bool]) -> set[str]:
    """The rows of a scope that "all" stands for: those that work with their defaults and those that are
    named; of a stage that has room for one, what is on without "all", else the first.

    named   whether a row is to be on, of rows that are named
    """
    rows = of_scope(scope)
    every = [name for name, row in rows.items() if row.ready or name in named]
    single = {row.stage for row in rows.values() if row.stage.single}
    for stage in single:
        rivals = [name for name in every if rows[name].stage is stage]
        chosen = [name for name in rivals if named.get(name, rows[name].default)] or rivals[:1]
        every = [name for name in every if name not in rivals or name in chosen]
    return set(every)
