"""docs/scenario.md is what the models are, and complete."""

from __future__ import annotations

import re

import pytest

from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.flightsw.app.config import options_of
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.flightsw.estimation.registry import NAVIGATORS
from gnss_hil.tools.schema.json_schema import KINDS, schema, table_in, tables
from gnss_hil.tools.schema.page import SWITCH, allowed, page
from gnss_hil.tools.schema.units import unit

WITHOUT_UNIT = {
    "alpha", "amplitude", "autonomous", "beta", "bulge_exponent", "channels", "clock_domain", "degree",
    "drag_coefficient", "eccentricity", "enabled", "forces", "least_amplitude", "mark_domain", "max", "min",
    "options", "plasmasphere_share", "radiation_coefficient", "receiver", "reflections", "seed", "ura_scale",
    "walk",
}  # fmt: skip
"""Keys of numbers that are pure, or whose unit is that of what they limit."""


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_has_a_unit_or_is_pure(kind):
    for header, table in tables(schema(kind)):
        for name, value in table["properties"].items():
            if '"number"' in str(value).replace("'", '"') and name not in WITHOUT_UNIT:
                assert unit(name), f"{header} {name}"


def test_every_factor_has_its_section_with_source_and_state():
    text = page()
    for name, row in FACTORS.items():
        section = re.search(rf"^### `\[(?:sky|craft)\.factors\.{name}\]`\n(.*?)(?=^##)", text, re.M | re.S)
        assert section and row.source in section[1]
        assert f"Where no scenario names it: {'on' if row.default else 'off'}." in section[1]
        assert f"| `{SWITCH}` |" not in section[1]


def test_every_row_has_six_cells():
    named = tuple(f"| `{name}` |" for name in (*POLICIES, *NAVIGATORS))
    rows = [line for line in page().splitlines() if line.startswith("| `") and not line.startswith(named)]
    assert len(rows) > 100
    assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} == {7}


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"type": "number", "minimum": 0, "exclusiveMaximum": 1}, "number [0, 1)"),
        ({"type": "integer", "exclusiveMinimum": 0}, "integer (0, inf)"),
        ({"type": "integer", "minimum": 6, "maximum": 9, "multipleOf": 3}, "integer [6, 9], in steps of 3"),
        ({"enum": ["a", "b"]}, '`"a"`, `"b"`'),
        ({"type": "array", "items": {"type": "string"}}, "list of: string"),
        ({"type": "array", "prefixItems": [{"type": "number"}] * 3}, "3 of: number"),
        ({"anyOf": [{"type": "string"}, {"type": "boolean"}]}, "string or boolean"),
        ({"type": "object", "patternProperties": {"^G": {"enum": [1]}}}, "table: name like `^G` = `1`"),
    ],
)  # fmt: skip
def test_what_a_key_may_hold(value, words):
    assert allowed({}, value) == words


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_has_a_meaning(kind):
    made = schema(kind)
    for header, table in tables(made):
        for name, value in table["properties"].items():
            if table_in(made, value) is None and name != SWITCH:
                assert value.get("description"), f"{header} {name}"


def test_every_option_of_the_flight_software_has_its_row():
    text = page()
    for policy in POLICIES.values():
        assert f"| `{policy.name}` | {policy.summary} |" in text
        assert all(f"| `{name}` |" in text for name in options_of(policy.name).model_fields)
