"""A scenario's document with what is changed of it, before it is checked as a whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

from gnss_hil.dbc.common import systems
from gnss_hil.dbc.process.command_line import Value
from gnss_hil.emulator.config.scenario import Flight, ScenarioError
from gnss_hil.emulator.error_models import registry
from gnss_hil.emulator.faults.files import gathered
from gnss_hil.emulator.files import rinex_nav
from gnss_hil.emulator.files.text import FileError
from gnss_hil.flightsw.app.config import carried_over
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config import recorded_receiver, set_keys
from gnss_hil.tools.run_config.config import Overrides

_LETTERS = {system.name: system.letter for system in systems.tracked()}


def overridden(document: Mapping[str, Any], overrides: Overrides) -> dict[str, Any]:
    """A new document; Mistake, ScenarioError or FaultError where the changes contradict each other or a
    file."""
    _check_files(overrides)
    changed = deepcopy(dict(document))
    time = changed.setdefault("time", {})
    for key, value in (("duration_s", overrides.duration_s), ("epoch_interval_s", overrides.interval_s)):
        if value is not None:
            time[key] = value
    if overrides.seed is not None:
        changed["seed"] = overrides.seed
    if overrides.nav:
        changed["sky"] = {**changed.get("sky", {}), **sky_of_files(overrides.nav)}
    recorded_receiver.override(changed, overrides)
    _switch(changed.setdefault("sky", {}), "sky", overrides)
    for number, craft in enumerate(changed.get("craft", [])):
        if isinstance(craft, dict):
            _override_craft(craft, number, overrides)
    added = gathered(overrides.fault_files, overrides.faults)
    if added:
        own = changed.get("fault", [])
        changed["fault"] = [*own, *(one.model_dump(mode="json", exclude_unset=True) for one in added)]
    if overrides.sets:
        _check_said_once(overrides)
        set_keys.apply(changed, overrides.sets)
    return changed


def _check_files(overrides: Overrides) -> None:
    """ScenarioError with a line for each file that the command line names and that there is not."""
    single = [("obs", overrides.obs), ("reference", overrides.reference)]
    named = [
        *(("nav", path) for path in overrides.nav),
        *(("sp3", path) for path in overrides.sp3),
        *((option, path) for option, path in single if path is not None),
    ]
    missing = [(option, path) for option, path in named if not path.exists()]
    if missing:
        raise ScenarioError("\n".join(f"--{o}: {path}: No such file or directory" for o, path in missing))


OPTIONS = {
    "time.duration_s": ("duration", "duration_s"), "time.epoch_interval_s": ("interval", "interval_s"),
    "seed": ("seed", "seed"),
}  # fmt: skip
"""Keys that have an option of their own: its name, and its field in `Overrides`."""


def _check_said_once(overrides: Overrides) -> None:
    for key, _ in overrides.sets:
        option, field = OPTIONS.get(".".join(map(str, set_keys.parsed(key))), ("", ""))
        if option and getattr(overrides, field) is not None:
            raise Mistake(f"--set {key} with --{option}: one of the two")


def _override_craft(craft: dict[str, Any], number: int, overrides: Overrides) -> None:
    if overrides.policy is not None:
        craft.setdefault("flight", {})["policy"] = overrides.policy
        for own in ("options", "navigator"):  # they belong to the policy that was replaced
            craft["flight"].pop(own, None)
    if overrides.navigator is not None:
        _replace_navigator(craft.setdefault("flight", {}), overrides.navigator)
    if overrides.ionosphere_free:
        craft.setdefault("flight", {}).setdefault("options", {})["ionosphere_free"] = True
    if overrides.options:
        options = craft.setdefault("flight", {}).setdefault("options", {})
        options.update(_once(overrides.options))
    if overrides.autonomous is not None:
        craft.setdefault("receivers", {})["autonomous"] = overrides.autonomous
    _switch(craft, "craft", overrides)
    if number in overrides.attitudes:
        craft["attitude"] = dict(overrides.attitudes[number])


def _replace_navigator(flight: dict[str, Any], name: str) -> None:
    """Another navigator, without the options that only the one it replaces has."""
    former, policy = flight.get("navigator"), flight.get("policy", Flight().policy)
    flight["navigator"] = name
    if isinstance(flight.get("options"), dict):
        with suppress(ValueError):  # a name that is not known has its line when the flight is configured
            flight["options"] = carried_over(flight["options"], policy, former, name)


def _switch(owner: Any, scope: str, overrides: Overrides) -> None:
    """Error models of a scope on or off; one that is switched on keeps the parameters of the scenario.

    A name counts more than "all", so that `--off all --on code_noise` leaves one.
    """
    on, off = overrides.on, overrides.off
    if not isinstance(owner, dict) or not (on or off):
        return
    factors = owner.setdefault("factors", {})
    rows = registry.of_scope(scope)
    both = sorted(set(on) & set(off))
    if both:
        raise Mistake(f"--on {both[0]} with --off {both[0]}: one of the two")
    named = {name: _enabled(given) for name, given in factors.items()} | dict.fromkeys(on, True)
    wanted: dict[str, bool] = {}
    if "all" in off:
        wanted = dict.fromkeys(rows, False)
    elif "all" in on:
        of_all = registry.of_all(scope, named)
        wanted = {name: True for name in rows if name in of_all}
    wanted |= {name: way for names, way in ((on, True), (off, False)) for name in names if name in rows}
    for name, enabled in wanted.items():
        given = factors.get(name)
        factors[name] = {**given, "enabled": enabled} if isinstance(given, dict) else enabled


def _enabled(given: Any) -> bool:
    """Whether an error model is on that a scenario gives like this."""
    return bool(given.get("enabled", True) if isinstance(given, dict) else given)


def _once(options: Sequence[tuple[str, Value]]) -> dict[str, Value]:
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
