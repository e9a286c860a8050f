"""What a run will be: scenario, command line and files made into one plan, every mistake found first."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common import vehicle as vehicles
from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.lockstep.messages import session_of
from gnss_hil.emulator.assemble import build_world
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.config.named_files import anchor, refuse_missing
from gnss_hil.emulator.config.scenario import Scenario, ScenarioError
from gnss_hil.emulator.faults import files as fault_files
from gnss_hil.emulator.step import World
from gnss_hil.flightsw.app.config import FlightConfig, configure
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.run_folder import vehicle_name
from gnss_hil.tools.results.summary import metric_names
from gnss_hil.tools.run_config.config import UNCHANGED, Overrides
from gnss_hil.tools.run_config.frame_budget import Budget, budget
from gnss_hil.tools.run_config.overrides import OPTIONS, overridden


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A run whose parts fit together.

    scenario       resolved: file names absolute, vehicles named as in the run folder
    vehicle_texts  the vehicle files, one for each craft
    flights        what the flight software of each craft is configured with
    session        run identifier on the bus, from the seed: the same run has the same frames
    """

    scenario: Scenario
    vehicles: tuple[Vehicle, ...]
    vehicle_texts: tuple[str, ...]
    flights: tuple[FlightConfig, ...]
    world: World
    budgets: tuple[Budget, ...]
    session: int

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(craft.name for craft in self.scenario.craft)

    @property
    def remarks(self) -> tuple[str, ...]:
        """On what is odd, a line each."""
        wanting = zip(self.scenario.craft, self.vehicles, self.flights, strict=True)
        return *self.world.remarks, *filter(None, (_lacking(*one) for one in wanting))

    @property
    def codecs(self) -> tuple[Codec, ...]:
        return tuple(craft.codec for craft in self.world.craft)


@dataclass(frozen=True, slots=True, eq=False)
class Resolved:
    """A scenario with all that is changed of it, and its craft's vehicles with their texts.

    remarks  on what the changes take away, a line each
    """

    path: Path
    scenario: Scenario
    vehicles: tuple[Vehicle, ...]
    texts: tuple[str, ...]
    remarks: tuple[str, ...] = ()

    def world(self, session: int, period_s: float | None = None) -> World:
        """The world of it, and its remarks with these."""
        made = build_world(self.scenario, self.vehicles, session, period_s=period_s)
        return replace(made, remarks=(*self.remarks, *made.remarks))


def resolve(name: str, overrides: Overrides = UNCHANGED) -> Resolved:
    """A scenario, shipped or a file; Mistake, ScenarioError or VehicleError say what is wrong."""
    path = scenarios.find(name)
    document = scenarios.read(path)
    missing = anchor(document, path.parent)
    changed = overridden(document, overrides)
    if overrides.sets:  # names of files on a command line are seen from where it is typed
        missing = anchor(changed, Path.cwd()) | missing
    try:
        scenario = scenarios.parse(changed, str(path))
    except ScenarioError as error:
        raise ScenarioError(_blamed(str(error), str(path), overrides)) from None
    refuse_missing(changed, missing)
    if overrides.vehicle and len(scenario.craft) > 1:
        raise Mistake(
            f"--vehicle: {path} has {len(scenario.craft)} craft; name their vehicles in the scenario"
        )
    files = [
        vehicles.find(overrides.vehicle) if overrides.vehicle else scenarios.vehicle_path(craft, path)
        for craft in scenario.craft
    ]
    loaded = tuple(vehicles.load(file) for file in files)
    texts = tuple(vehicles.FILES.text(file) for file in files)
    return Resolved(path, scenario, loaded, texts, tuple(_gone(document.get("sky", {}), scenario, overrides)))


def _gone(before: Mapping[str, Any], scenario: Scenario, overrides: Overrides) -> Iterator[str]:
    """A line for each system of the sky before that files of the command line leave out."""
    files, usual = ", ".join(map(str, overrides.nav)), scenarios.Sky().sources()
    for name, source in scenario.sky.sources().items() if files else ():
        if source == "none" != before.get(name, usual[name]):
            yield f"--nav: {files}: no {name.upper()} record: the sky is without {name.upper()}"


def _blamed(text: str, origin: str, overrides: Overrides) -> str:
    """Faults of keys that the command line has set are the command line's."""
    blamed = [(key.replace('"', ""), "--set ") for key, _ in overrides.sets]
    blamed += [
        (key, f"--{name}: ")
        for key, (name, field) in OPTIONS.items()
        if getattr(overrides, field) is not None
    ]
    # Length and step that do not fit each other.
    blamed += [("time:", option) for key, option in blamed if key.startswith("time.")][:1]
    lines = text.splitlines()
    for key, option in blamed:
        begin = f"{origin}: {key}"
        lines = [option + line[len(origin) + 2 :] if line.startswith(begin) else line for line in lines]
    return "\n".join(lines)


def _with_origins(text: str, found: Resolved, overrides: Overrides) -> str:
    """Lines that blame a fault by its number in the scenario, with where it is from and as it was typed."""
    files = [fault_files.FILES.find(str(path)) for path in overrides.fault_files]
    added = [f"{path}: fault.{n}" for path in files for n in range(len(fault_files.load(path).fault))]
    added += [f"--fault '{line}'" for line in overrides.faults]
    own = [f"{found.path}: fault.{n}" for n in range(len(found.scenario.fault) - len(added))]
    origin = dict(enumerate([*own, *added]))
    return re.sub(r"(?m)^fault\.(\d+)", lambda match: origin.get(int(match[1]), match[0]), text)


def budgets_of(scenario: Scenario, loaded: Sequence[Vehicle], world: World) -> tuple[Budget, ...]:
    """The frame budget of each craft's bus."""
    almanac = len(world.sky.index)
    return tuple(
        budget(v, scenario.time.epoch_interval_s, almanac, craft.receivers.almanac_cycle_s)
        for craft, v in zip(scenario.craft, loaded, strict=True)
    )


def check_load(scenario: Scenario, budgets: Sequence[Budget]) -> None:
    """Mistake with the figures of every bus that would overflow."""
    refusals = [b.refusal(craft.name) for craft, b in zip(scenario.craft, budgets, strict=True)]
    if any(refusals):
        raise Mistake("\n".join(filter(None, refusals)))


def make(name: str, overrides: Overrides = UNCHANGED, refuse_overload: bool = True) -> Plan:
    """The plan of a scenario, shipped or a file; Mistake, ScenarioError or VehicleError say what is wrong."""
    found = resolve(name, overrides)
    scenario, loaded = found.scenario, found.vehicles
    flights = tuple(map(_flight, scenario.craft, loaded))
    _check_expectations(scenario, flights, str(found.path))
    session = session_of(scenario.seed)
    try:
        world = found.world(session)
    except ScenarioError as error:
        raise ScenarioError(_with_origins(str(error), found, overrides)) from None
    _check_obedience(scenario, world, flights)
    budgets = budgets_of(scenario, loaded, world)
    if refuse_overload:
        check_load(scenario, budgets)
    names = [craft.name for craft in scenario.craft]
    craft = [c.model_copy(update={"vehicle": vehicle_name(names, i)}) for i, c in enumerate(scenario.craft)]
    renamed = scenario.model_copy(update={"craft": craft})
    return Plan(renamed, loaded, found.texts, flights, world, budgets, session)


def _lacking(craft: scenarios.Craft, vehicle: Vehicle, flight: FlightConfig) -> str | None:
    """A line where fixes are to be made of two carriers and no receiver of the craft has two."""
    if craft.observations is not None or not flight.options.ionosphere_free or flight.second.any():
        return None
    serves = flight.options.without_pairs == "one-signal"
    return (
        f"craft {craft.name}: ionosphere_free: vehicle '{vehicle.name}' names no other_signals: "
        f"{'its fixes are by one signal of each satellite' if serves else 'no fix'}"
    )


def _flight(craft: scenarios.Craft, vehicle: Vehicle) -> FlightConfig:
    try:
        flight = craft.flight
        return configure(vehicle, flight.policy, flight.options, navigator_name=flight.navigator)
    except ValueError as error:
        raise Mistake("\n".join(f"craft {craft.name}: {line}" for line in str(error).splitlines())) from None


def _check_obedience(scenario: Scenario, world: World, flights: Sequence[FlightConfig]) -> None:
    """A receiver that is played does nothing that it is commanded: a policy would command it in vain."""
    for craft, played, flight in zip(scenario.craft, world.craft, flights, strict=True):
        if not played.obeys and flight.policy.assign is not None:
            free = ", ".join(name for name, row in POLICIES.items() if row.assign is None)
            raise Mistake(
                f"craft {craft.name}: policy '{craft.flight.policy}' commands receivers; this one is "
                f"played; use {free}"
            )


def _check_expectations(scenario: Scenario, flights: Sequence[FlightConfig], origin: str) -> None:
    if not scenario.expect:
        return
    known, timed = metric_names([craft.name for craft in scenario.craft], flights[0].codec)
    faults = []
    for name, limits in scenario.expect.items():
        if name not in known:
            faults.append(f"expect.{name}: no such figure; {did_you_mean(name, sorted(known))}")
        elif limits.after_s is None:
            continue
        elif name not in timed:
            faults.append(f"expect.{name}: is of the whole run, it takes no after_s")
        elif limits.after_s > (scenario.time.epochs - 1) * scenario.time.epoch_interval_s:
            faults.append(
                f"expect.{name}: after_s {limits.after_s:g} leaves no epoch of a run of "
                f"{scenario.time.duration_s:g} s"
            )
    if faults:
        raise Mistake("\n".join(f"{origin}: {fault}" for fault in faults))
