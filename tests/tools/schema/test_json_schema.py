"""The JSON schemas accept what the models accept, and refuse what an editor can see to be wrong."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.schema.examples import WRITTEN
from gnss_hil.tools.schema.json_schema import (
    KINDS,
    file_name,
    of_model,
    schema,
    split_docstring,
    table_in,
    tables,
    text,
)

pytestmark = pytest.mark.verifies(
    "tools/schema/json_schema.py",
    "tools/schema/examples.py",
    "tools/schema/page.py",
    "tools/schema/units.py",
    what="JSON schemas and the page of every key",
    by=(
        "the package jsonschema: every shipped file valid, wrong ones refused where the mistake is, and by "
        "the models too"
    ),
    status="validated",
)

ROOT = Path(__file__).parents[3]
VALIDATORS = {kind: Draft202012Validator(schema(kind)) for kind in KINDS}
OWN = [
    ("vehicle", ROOT / "examples/receiver_py/single.toml"),
    ("scenario", ROOT / "examples/ci/acceptance.toml"),
]
SHIPPED = [(kind, path) for kind, files in KINDS.items() for path in files.shipped().values()]


def mistakes(kind: str, document: dict) -> list[str]:
    """Paths of the keys that the schema refuses."""
    return [error.json_path for error in VALIDATORS[kind].iter_errors(document)]


@pytest.mark.parametrize("kind", KINDS)
def test_schema_is_one(kind):
    Draft202012Validator.check_schema(schema(kind))


@pytest.mark.parametrize(("kind", "path"), SHIPPED + OWN, ids=lambda value: getattr(value, "stem", value))
def test_shipped_files_are_valid(kind, path):
    assert mistakes(kind, tomllib.loads(path.read_text("utf-8"))) == []


@pytest.mark.parametrize(("kind", "path"), SHIPPED + OWN, ids=lambda value: getattr(value, "stem", value))
def test_shipped_files_point_editors_to_the_schema(kind, path):
    first = path.read_text("utf-8").splitlines()[0]
    named = re.fullmatch(r"#:schema (\.{1,2}/\S+)", first)
    assert named and (path.parent / named[1]).read_text("utf-8") == text(kind)


def soyuz() -> dict:
    return scenario.read(scenario.shipped()["soyuz"])


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (lambda d: d["time"].update(duration=600), "$.time"),
        (lambda d: d["time"].update(duration_s="long"), "$.time.duration_s"),
        (lambda d: d["time"].update(duration_s=0), "$.time.duration_s"),
        (lambda d: d["time"].update(start_gps="2012-10-31T00:15:00Z"), "$.time.start_gps"),
        (lambda d: d["time"].pop("start_gps"), "$.time"),
        (lambda d: d["craft"].clear(), "$.craft"),
        (lambda d: d["craft"][0]["orbit"].update(inclination_deg=181), "$.craft[0].orbit.inclination_deg"),
        (lambda d: d["craft"][0]["orbit"].update(forces=["j2", "j5"]), "$.craft[0].orbit.forces[1]"),
        (lambda d: d["craft"][0].update(factors={"code_nois": True}), "$.craft[0].factors"),
        (lambda d: d["craft"][0].update(factors={"code_noise": 1}), "$.craft[0].factors.code_noise"),
        (lambda d: d["craft"][0].update(factors={"ionosphere": True}), "$.craft[0].factors"),
        (lambda d: d.update(expect={"soyuz.fixes": {"least": 3}}), "$.expect['soyuz.fixes']"),
    ],
)
def test_wrong_scenarios_are_refused(change, where):
    """By the schema where the mistake is, and by the model."""
    document = soyuz()
    change(document)
    found = mistakes("scenario", document)
    assert len(found) == 1 and found[0].startswith(where)
    with pytest.raises(scenario.ScenarioError):
        scenario.parse(document, "wrong.toml")


def test_a_wrong_vehicle_is_refused():
    document = vehicle.FILES.read(vehicle.shipped()["soyuz-ms"])
    document["antenna"][2]["boresight_body"].append(0.0)
    assert mistakes("vehicle", document) == ["$.antenna[2].boresight_body"]


@pytest.mark.parametrize("name", FACTORS)
@pytest.mark.parametrize("value", [True, False, {}, {"enabled": False}])
def test_every_factor_is_a_switch_or_a_table(name, value):
    document = soyuz()
    owner = document["sky"] if FACTORS[name].scope == "sky" else document["craft"][0]
    owner["factors"] = {name: value}
    assert mistakes("scenario", document) == []


def test_parameters_of_every_factor_are_in_the_schema():
    made = schema("scenario")
    headers = {header for header, _ in tables(made)}
    for name, row in FACTORS.items():
        owner = "sky" if row.scope == "sky" else "craft"
        assert f"[{owner}.factors.{name}]" in headers


def keys_of(kind: str) -> dict[str, dict]:
    """Every key of a kind of file with its path -> its schema."""
    made = schema(kind)
    return {
        f"{header.strip('[]')}.{name}".lstrip("."): {**value, "$defs": made.get("$defs", {})}
        for header, table in tables(made)
        for name, value in table["properties"].items()
        if table_in(made, value) is None
    }


@pytest.mark.parametrize("kind", WRITTEN)
def test_written_examples_are_allowed(kind):
    keys = keys_of(kind)
    for key, value in WRITTEN[kind].items():
        Draft202012Validator(keys[key]).validate(value)


def test_null_is_nowhere():
    """TOML has none."""
    assert not any('"null"' in text(kind) or ": null" in text(kind) for kind in KINDS)


DOCSTRING = """How it is.

a_m, b_m   lengths, and
           how
..._s      times
the others  rest
More of it."""


def test_docstrings_of_keys():
    lead, keys = split_docstring(DOCSTRING)
    assert lead == "How it is. More of it."
    assert keys == [
        ("a_m", "lengths, and how"),
        ("b_m", "lengths, and how"),
        ("*_s", "times"),
        ("*", "rest"),
    ]


def test_a_model_says_what_its_keys_mean():
    made = of_model(scenario.Clock)
    assert made["properties"]["mark_domain"]["description"].startswith("clock domain")


def test_command_writes_what_ships(tmp_path, capsys):
    assert main(["schema", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.count('"#:schema ./') == len(KINDS)
    for kind in KINDS:
        assert (tmp_path / file_name(kind)).read_text("utf-8") == text(kind)
    assert main(["schema", "vehicle"]) == 0
    assert capsys.readouterr().out == text("vehicle")


@pytest.mark.parametrize("words", [["schema"], ["schema", "scenarios"]])
def test_command_says_what_it_takes(words, capsys):
    assert main(words) == 2
    assert "scenario, vehicle, structure" in capsys.readouterr().err
