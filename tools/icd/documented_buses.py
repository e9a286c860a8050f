"""Of which contract and which buses the document is, from a scenario and a number of receivers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.tools.command_line.arguments import DEFAULT_SCENARIO
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.icd.contract import Contract, load
from gnss_hil.tools.run_config.frame_budget import Budget, budget
from gnss_hil.tools.run_config.plan import Plan, make


@dataclass(frozen=True, slots=True)
class Bus:
    """A spacecraft's bus in the scenario of which the budget is."""

    craft: str
    vehicle: str
    budget: Budget


@dataclass(frozen=True, slots=True)
class Subject:
    """What the document is of."""

    contract: Contract
    scenario: str
    buses: tuple[Bus, ...]


def subject(scenario: str | None, receivers: int | None) -> Subject:
    """The contract has the receivers of the scenario's vehicles. Where none is named, `receivers` may be any
    number: the budget is that of the default scenario with so many of its receivers."""
    plan = make(scenario or DEFAULT_SCENARIO, refuse_overload=False)
    counts = {vehicle.antennas for vehicle in plan.vehicles}
    if scenario is None and receivers is not None and receivers not in counts:
        return _resized(plan, receivers)
    if receivers is None and len(counts) > 1:
        raise Mistake(f"{scenario}: its craft have {_listed(counts)} receivers; choose with --receivers N")
    count = receivers or counts.pop()
    rows = zip(plan.names, plan.vehicles, plan.budgets, strict=True)
    buses = tuple(Bus(craft, v.name, load) for craft, v, load in rows if v.antennas == count)
    if not buses:
        raise Mistake(f"{scenario}: its craft have {_listed(counts)} receivers, not --receivers {receivers}")
    return Subject(load(codec(count)), scenario or DEFAULT_SCENARIO, buses)


def _listed(counts: set[int]) -> str:
    return " and ".join(map(str, sorted(counts)))


def _resized(plan: Plan, receivers: int) -> Subject:
    name, vehicle, craft = plan.names[0], plan.vehicles[0], plan.scenario.craft[0]
    load_of_bus = budget(
        _with_receivers(vehicle, receivers),
        plan.scenario.time.epoch_interval_s,
        len(plan.world.sky.index),
        craft.receivers.almanac_cycle_s,
    )
    bus = Bus(name, f"{vehicle.name} with {receivers} of its receivers", load_of_bus)
    return Subject(load(codec(receivers)), f"{DEFAULT_SCENARIO} with {receivers} receivers", (bus,))


def _with_receivers(vehicle: Vehicle, m: int) -> Vehicle:
    """A vehicle with m antennas, those of another in turn."""
    rows = np.resize(np.arange(vehicle.antennas), m)
    arrays = ("channels", "clock_domain", "boresight_body", "lever_arm_body_m", "mask_rad")
    names = tuple(f"{vehicle.names[row]}-{k}" for k, row in enumerate(rows, 1))
    return replace(vehicle, names=names, **{field: getattr(vehicle, field)[rows] for field in arrays})
