"""What a run will be: scenario, command line and files made into one plan, every mistake found first."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common import systems
from gnss_hil.dbc.common import vehicle as vehicles
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.lockstep.messages import session_of
from gnss_hil.emulator.assemble import build_world
from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.emulator.config.named_files import anchor
from gnss_hil.emulator.config.scenario import Scenario, ScenarioError
from gnss_hil.emulator.error_models.registry import of_scope
from gnss_hil.emulator.files import rinex_nav
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.step import World
from gnss_hil.flightsw.app.step import FlightConfig, configure
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.results.summary import metric_names
from gnss_hil.tools.run_config import recorded_receiver
from gnss_hil.tools.run_config.frame_budget import Budget, budget

_LETTERS = {system.name: system.letter for system in systems.tracked()}


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
    def codecs(self) -> tuple[Codec, ...]:
        return tuple(craft.codec for craft in self.world.craft)


def vehicle_name(craft: Sequence[str], i: int) -> str:
    """Name of a craft's vehicle file in a run folder."""
    return "vehicle.toml" if len(craft) == 1 else f"vehicle-{craft[i]}.toml"


def make(
    arguments: Namespace,
    refuse_overload: bool = True,
    change: Callable[[dict[str, Any]], None] = lambda document: None,
) -> Plan:
    """The plan of a command line; Mistake, ScenarioError or VehicleError say what is wrong.

    change   what else is done to the scenario's document before it is checked
    """
    path = scenarios.find(arguments.scenario)
    document = scenarios.read(path)
    anchor(document, path.parent)
    _change(document, arguments)
    change(document)
    scenario = scenarios.parse(document, str(path))
    if arguments.vehicle and len(scenario.craft) > 1:
        raise Mistake(
            f"--vehicle: {path} has {len(scenario.craft)} craft; name their vehicles in the scenario"
        )
    files = [
        vehicles.find(arguments.vehicle) if arguments.vehicle else scenarios.vehicle_path(craft, path)
        for craft in scenario.craft
    ]
    loaded = tuple(vehicles.load(file) for file in files)
    texts = tuple(Path(file).read_text("utf-8") for file in files)
    flights = tuple(map(_flight, scenario.craft, loaded))
    _check_obedience(scenario, flights)
    _check_expectations(scenario, flights, str(path))
    session = session_of(scenario.seed)
    world = build_world(scenario, loaded, session)
    almanac = len(world.sky.index)
    budgets = tuple(
        budget(v, scenario.time.epoch_interval_s, almanac, craft.receivers.almanac_cycle_s)
        for craft, v in zip(scenario.craft, loaded, strict=True)
    )
    refusals = [b.refusal(craft.name) for craft, b in zip(scenario.craft, budgets, strict=True)]
    if refuse_overload and any(refusals):
        raise Mistake("\n".join(filter(None, refusals)))
    names = [craft.name for craft in scenario.craft]
    craft = [c.model_copy(update={"vehicle": vehicle_name(names, i)}) for i, c in enumerate(scenario.craft)]
    return Plan(scenario.model_copy(update={"craft": craft}), loaded, texts, flights, world, budgets, session)


def _change(document: dict[str, Any], a: Namespace) -> None:
    """Put what the command line says into the document, before it is checked as a whole."""
    time = document.setdefault("time", {})
    for key, value in (("duration_s", a.duration), ("epoch_interval_s", a.interval)):
        if value is not None:
            time[key] = value
    if a.seed is not None:
        document["seed"] = a.seed
    if a.nav:
        document["sky"] = {**document.get("sky", {}), **sky_of_files(a.nav)}
    recorded_receiver.change(document, a)
    _switch(document.setdefault("sky", {}), "sky", a)
    for craft in document.get("craft", []):
        if not isinstance(craft, dict):
            continue
        if a.policy is not None:
            craft.setdefault("flight", {})["policy"] = a.policy
            craft["flight"].pop("options", None)  # they belong to the policy that was replaced
        if a.option:
            options = craft.setdefault("flight", {}).setdefault("options", {})
            options.update(_once(a.option))
        if a.autonomous is not None:
            craft.setdefault("receivers", {})["autonomous"] = a.autonomous
        _switch(craft, "craft", a)


def _switch(owner: Any, scope: str, a: Namespace) -> None:
    """Factors of a scope on or off; one that is switched on keeps the parameters the scenario gives it.

    A name counts more than "all", so that `--off all --on code_noise` leaves one.
    """
    if not isinstance(owner, dict) or not (a.on or a.off):
        return
    factors = owner.setdefault("factors", {})
    rows = of_scope(scope)
    both = sorted(set(a.on) & set(a.off))
    if both:
        raise Mistake(f"--on {both[0]} with --off {both[0]}: one of the two")
    ways = ((a.on, True), (a.off, False))
    wanted = {name: way for names, way in ways if "all" in names for name in rows}
    wanted |= {name: way for names, way in ways for name in names if name in rows}
    for name, enabled in wanted.items():
        if enabled and not (rows[name].ready or name in factors or name in a.on):
            continue
        given = factors.get(name)
        factors[name] = {**given, "enabled": enabled} if isinstance(given, dict) else enabled


def _once(options: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    for key, _ in options:
        values = [str(v) for k, v in options if k == key]
        if len(values) > 1:
            raise Mistake(f"--option {key}: given {len(values)} times ({', '.join(values)})")
    return dict(options)


def sky_of_files(paths: Sequence[Path]) -> dict[str, Any]:
    """[sky] of navigation files: each system has the files that hold its records, or is "none"."""
    try:
        held = {path: set(rinex_nav.read(path).records) for path in paths}
    except FileError as error:
        raise ScenarioError(f"--nav: {error}") from None
    idle = [str(path) for path, letters in held.items() if not letters & set(_LETTERS.values())]
    if idle:
        names = " nor a ".join(name.upper() for name in _LETTERS)
        raise ScenarioError(f"--nav: {', '.join(idle)}: neither a {names} record")
    return {
        system: [str(path.resolve()) for path in paths if letter in held[path]] or "none"
        for system, letter in _LETTERS.items()
    }


def _flight(craft: scenarios.Craft, vehicle: Vehicle) -> FlightConfig:
    try:
        return configure(vehicle, craft.flight.policy, craft.flight.options)
    except ValueError as error:
        raise Mistake("\n".join(f"craft {craft.name}: {line}" for line in str(error).splitlines())) from None


def _check_obedience(scenario: Scenario, flights: Sequence[FlightConfig]) -> None:
    """A real receiver that is played obeys nobody: a policy that commands it would do so in vain."""
    for craft, flight in zip(scenario.craft, flights, strict=True):
        if craft.observations is not None and flight.policy.assign is not None:
            free = ", ".join(name for name, row in POLICIES.items() if row.assign is None)
            raise Mistake(
                f"craft {craft.name}: policy '{craft.flight.policy}' commands receivers; this one is "
                f"played; use {free}"
            )


def _check_expectations(scenario: Scenario, flights: Sequence[FlightConfig], origin: str) -> None:
    if not scenario.expect:
        return
    known = metric_names([craft.name for craft in scenario.craft], flights[0].codec)
    unknown = [name for name in scenario.expect if name not in known]
    if unknown:
        raise Mistake(
            "\n".join(
                f"{origin}: expect.{name}: no such figure; allowed are {', '.join(sorted(known))}"
                for name in unknown
            )
        )
