"""JSON schemas of the TOML files, from the models that check them.

Editors that know the comment `#:schema ./scenario.schema.json` (taplo, Even Better TOML) complete keys, show
their meaning and mark mistakes as they are typed. A schema is what pydantic makes of the model, without null,
which TOML has not, and with the meaning of a key where a model's docstring has it.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from fnmatch import fnmatch
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.common.shipped_files import Files
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.faults import files as faults
from gnss_hil.emulator.signal.structure import file as structure
from gnss_hil.flightsw.app.config import Options
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.flightsw.estimation.registry import NAVIGATORS

DIALECT = "https://json-schema.org/draft/2020-12/schema"

KINDS: dict[str, Files[Any]] = {
    "scenario": scenario.FILES,
    "vehicle": vehicle.FILES,
    "structure": structure.FILES,
    "faults": faults.FILES,
}
"""Kind of file -> its model, and where those are that ship."""

Schema = dict[str, Any]

_KEY = re.compile(r"^(?P<keys>[\w.*]+(?:, [\w.*]+)*|the others) {2,}(?P<text>\S.*)$")


def file_name(kind: str) -> str:
    """Of a kind's schema."""
    return f"{kind}.schema.json"


def schema(kind: str) -> Schema:
    """The JSON schema of a kind of file."""
    made = {"$schema": DIALECT, "title": f"gnss-hil {kind} file", **of_model(KINDS[kind].model)}
    if kind == "scenario":
        _open_flight(made)
    return made


def _open_flight(made: Schema) -> None:
    """[craft.flight] with the names and the options of our flight software, which the scenario, the truth's
    side, does not know: in place."""
    flight = made["$defs"]["Flight"]["properties"]
    flight["policy"]["enum"], flight["navigator"]["enum"] = list(POLICIES), list(NAVIGATORS)
    flight["options"] |= {"properties": flight_options(), "additionalProperties": False}


def flight_options() -> Schema:
    """Option -> its schema: those of any flight, then those that one policy or navigator alone has, whose
    meaning ends with the owner. A policy that narrows an option of any flight is checked when it is flown."""
    found: dict[str, Schema] = dict(of_model(Options)["properties"])
    own = [(f"of policy `{row.name}`", row.options) for row in POLICIES.values()]
    own += [(f"of navigator `{row.name}`", row.options) for row in NAVIGATORS.values()]
    for owner, model in own:
        for name, value in of_model(model).get("properties", {}).items():
            if name in Options.model_fields:
                continue
            marked = {**value, "description": f"{value.get('description', '')} ({owner})".strip()}
            found[name] = {"anyOf": [found[name], marked]} if name in found else marked
    return found


def text(kind: str) -> str:
    """The schema as it stands in a file."""
    return json.dumps(schema(kind), indent=1, ensure_ascii=False) + "\n"


def of_model(model: type[BaseModel]) -> Schema:
    """The JSON schema of a model, as TOML can say it."""
    return model.model_json_schema(schema_generator=_OfToml)


class _OfToml(GenerateJsonSchema):
    """Without null, without titles made of names, without defaults of whole tables; keys have the meanings
    that the docstrings of a model, and of those it inherits from, list."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def nullable_schema(self, schema: core_schema.NullableSchema) -> Schema:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> Schema:
        made = super().default_schema(schema)
        if made.get("default") is None or isinstance(made["default"], dict):
            made.pop("default", None)
        return made

    def model_schema(self, schema: core_schema.ModelSchema) -> Schema:
        made = super().model_schema(schema)
        made.pop("title", None)
        lead, _ = split_docstring(made.pop("description", ""))
        made = {**made, "description": lead} if lead else made
        for model in schema["cls"].__mro__:
            _describe(made.get("properties", {}), split_docstring(inspect.cleandoc(model.__doc__ or ""))[1])
        return made


def _describe(properties: Schema, keys: list[tuple[str, str]]) -> None:
    """Meanings of keys that have none yet."""
    for name, value in properties.items():
        found = next((meaning for pattern, meaning in keys if fnmatch(name, pattern)), None)
        if found and "description" not in value:
            value["description"] = found


def split_docstring(docstring: str) -> tuple[str, list[tuple[str, str]]]:
    """What a docstring says of a table as a whole, and of its keys: (pattern of the key's name, meaning).

    A list of keys has lines of names, two or more blanks, and text, which goes on in indented lines. `...`
    and `*` stand for any part of a name, "the others" for all that are not named.
    """
    lead: list[str] = []
    keys: list[tuple[list[str], list[str]]] = []
    inside = False
    for line in docstring.splitlines():
        found = _KEY.match(line)
        if found:
            patterns = found["keys"].replace("the others", "*").replace("...", "*").split(", ")
            keys.append((patterns, [found["text"]]))
        elif inside and line.startswith(" "):
            keys[-1][1].append(line.strip())
        else:
            lead.append(line)
        inside = bool(found) or (inside and line.startswith(" "))
    meanings = [(pattern, " ".join(lines)) for patterns, lines in keys for pattern in patterns]
    return " ".join(" ".join(lead).split()), meanings


def tables(made: Schema, table: Schema | None = None, header: str = "") -> Iterator[tuple[str, Schema]]:
    """Every table of a schema, or within one of its tables, with its TOML header (`[sky]`, `[[craft]]`,
    `[expect.NAME]`), outer ones first.

    The root has no header. A table that occurs in two places comes twice.
    """
    table = made if table is None else table
    yield header, table
    path = header.strip("[]")
    for name, value in table.get("properties", {}).items():
        if found := table_in(made, value):
            inner, form = found
            yield from tables(made, inner, form.format(f"{path}.{name}" if path else name))


def table_in(made: Schema, value: Schema) -> tuple[Schema, str] | None:
    """The table that a key holds (one, an array of them, or by name) and its header's form; None without."""
    for option in value.get("anyOf", [value]):
        whole = resolved(made, option)
        inside = (
            (whole, "[{}]"),
            (whole.get("items"), "[[{}]]"),
            (whole.get("additionalProperties"), "[{}.NAME]"),
        )
        for node, form in inside:
            if isinstance(node, dict) and "properties" in resolved(made, node):
                return resolved(made, node), form
    return None


def resolved(made: Schema, node: Schema) -> Schema:
    """A node, or what it refers to."""
    reference = node.get("$ref")
    return made["$defs"][reference.rsplit("/", 1)[1]] if reference else node
