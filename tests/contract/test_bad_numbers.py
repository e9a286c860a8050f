"""Every number of files, of the flight's options and of the command line, tried with what is none."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from gnss_hil.dbc.common import model_tree
from gnss_hil.dbc.common.vehicle import VehicleFile
from gnss_hil.emulator.config.scenario import Scenario, ScenarioError
from gnss_hil.emulator.signal.structure.file import StructureFile
from gnss_hil.flightsw.app.config import options_of
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.flightsw.estimation.registry import NAVIGATORS
from gnss_hil.tools.command_line.main import COMMANDS, Parser, parser_of
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config.config import Overrides
from gnss_hil.tools.run_config.plan import resolve

NONSENSE = (math.nan, math.inf, -math.inf, 1e308, -1e308, "text", True, [[]])
"""No key can mean any of these, whatever it is."""


def bounds(schema: Any) -> Iterator[tuple[float | None, float | None]]:
    """Least and greatest of every number that a JSON schema speaks of."""
    if isinstance(schema, dict):
        if schema.get("type") in ("number", "integer"):
            least = schema.get("minimum", schema.get("exclusiveMinimum"))
            yield least, schema.get("maximum", schema.get("exclusiveMaximum"))
        for part in schema.values():
            yield from bounds(part)
    elif isinstance(schema, list):
        for part in schema:
            yield from bounds(part)


def properties(schema: dict) -> dict:
    """Keys of a table, or of one that may be written as text too."""
    options = [schema, *schema.get("anyOf", ())]
    return next(one["properties"] for one in options if "properties" in one)


def numbers(model: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel], str, dict]]:
    """Path, model, key and schema of every value that holds a number."""
    for path, _ in model_tree.values(model):
        key = str(path[-1])
        for option in model_tree.options(model_tree.at(model, path[:-1])):
            if key in getattr(option, "model_fields", {}) and key != "options":  # those have models below
                schema = properties(option.model_json_schema())[key]
                if any(bounds(schema)):
                    yield ".".join(map(str, path)), option, key, schema


MODELS = {
    "scenario": Scenario, "vehicle": VehicleFile, "structure": StructureFile,
    **{f"options of {p}": options_of(p) for p in POLICIES},
    **{f"options by {n}": options_of("patent", n) for n in NAVIGATORS},
}  # fmt: skip
EVERY = [(f"{name}: {row[0]}", *row[1:]) for name, model in MODELS.items() for row in numbers(model)]
NAMES = [name for name, *_ in EVERY]


def test_all_numbers_are_found():
    """As many as docs/scenario.md has rows, about."""
    assert len(set(NAMES)) > 150
    assert {"scenario: craft.0.clock.period_s", "vehicle: antenna.0.lever_arm_body_m"} <= set(NAMES)


@pytest.mark.parametrize(("name", "model", "key", "schema"), EVERY, ids=NAMES)
def test_every_number_has_a_least_and_a_greatest(name, model, key, schema):
    """Nothing that is flown, built or measured is larger than 1e15, in any unit."""
    for least, greatest in bounds(schema):
        assert least is not None and greatest is not None, name
        assert abs(least) <= 1e15 and (abs(greatest) <= 1e15 or key == "seed")


@pytest.mark.parametrize(("name", "model", "key", "schema"), EVERY, ids=NAMES)
def test_no_number_takes_what_is_none(name, model, key, schema):
    switched = {"enabled": True} if "enabled" in model.model_fields else {}
    for value in NONSENSE:
        if (value is True and "boolean" in str(schema)) or (value == "text" and "string" in str(schema)):
            continue  # which may stand there
        with pytest.raises(ValidationError) as caught:
            model.model_validate({**switched, key: value})
        assert any(fault["loc"][:1] == (key,) for fault in caught.value.errors()), value


SCENARIO_KEYS = sorted({name.removeprefix("scenario: ") for name in NAMES if name.startswith("scenario: ")})


@pytest.mark.parametrize("key", SCENARIO_KEYS)
def test_no_number_of_a_scenario_takes_what_is_none_from_the_command_line(key):
    """As `--set KEY=VALUE` has it, with all that a plan checks: lines for people, and no other exception."""
    for text in ("nan", "inf", "-inf", "1e308", "-1e308", "text", "", "[[]]", "1979-05-27"):
        with pytest.raises((Mistake, ScenarioError)) as caught:
            resolve("soyuz", Overrides(sets=((key, text),)))
        assert str(caught.value)


def typed_arguments() -> Iterator[tuple[str, Parser, str]]:
    """Options of every command that read a number."""
    for command in COMMANDS.values():
        parser = parser_of(command)
        for action in parser._actions:
            if reads_a_number(action):
                yield f"{command.name} {action.option_strings[-1]}", parser, action.option_strings[-1]


def reads_a_number(action: argparse.Action) -> bool:
    """Whether an option makes a number of what is typed, or is a pace."""
    if action.type is None or not action.option_strings:
        return False
    if action.option_strings[-1] == "--pace":
        return True
    try:
        return isinstance(action.type("1"), int | float)
    except (argparse.ArgumentTypeError, ValueError):
        return False


ARGUMENTS = list(typed_arguments())
BAD = ("nan", "inf", "-inf", "1e308", "-1", "text", "", "1e400", "0x10", "\u0663")


def test_the_numbers_of_the_command_line_are_found():
    wanted = {"run --duration", "emulate --wait", "replay --limit", "study --jobs", "fly --boot-count"}
    assert wanted <= {name for name, *_ in ARGUMENTS}


@pytest.mark.parametrize(("name", "parser", "option"), ARGUMENTS, ids=[name for name, _, _ in ARGUMENTS])
@pytest.mark.parametrize("text", BAD)
def test_no_number_of_the_command_line_takes_what_is_none(name, parser, option, text):
    first = ["factors"] if name.startswith("study") else []
    with pytest.raises(Mistake) as caught:
        parser.parse_args([*first, f"{option}={text}"])
    assert len(str(caught.value).splitlines()) == 1
    assert option in str(caught.value)
