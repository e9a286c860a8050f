"""docs/scenario.md: every key of the files a user writes, from their JSON schemas.

python -m gnss_hil.tools.schema.page > docs/scenario.md
"""

from __future__ import annotations

import json
import sys
from typing import Any

from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.flightsw.app.config import Options
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.flightsw.estimation.registry import NAVIGATORS
from gnss_hil.tools.schema.examples import examples
from gnss_hil.tools.schema.json_schema import KINDS, file_name, of_model, resolved, schema, table_in, tables
from gnss_hil.tools.schema.units import unit

SWITCH = "enabled"
"""The key that every factor has; told once, not in each table."""

HEAD = "| key | value | unit | default | example | meaning |\n|---|---|---|---|---|---|"

LEAD = """# Scenario and vehicle files

Written by `make docs` from the models that check the files; do not edit. All are TOML, checked whole before
anything runs: unknown keys, values out of range and contradictions are reported together, one line each.
Numbers lie in the range that is given: [ ] with its ends, ( ) without. Where no example is given, the default
is one.

**In an editor.** The files that ship begin with `#:schema`, by which editors with taplo (VS Code: *Even
Better TOML*) complete keys and mark mistakes. For your own, write the schemas beside it:

    gnss-hil schema --out .

and begin your file with `#:schema ./scenario.schema.json` (or `vehicle`, `structure`).
`gnss-hil schema scenario` prints one, for any other JSON Schema validator.

**Files that a scenario names** (navigation, orbits, observations, ...) are looked for beside the scenario,
then in the folder of `GNSS_HIL_DATA`. Vehicles and structures may also be those that ship, by name.
"""

ABOUT = {
    "scenario": """What is played: time, sky, craft, errors, and what is expected of the run.
`gnss-hil scenarios --path` shows those that ship. On the command line `--on NAME` and `--off NAME` switch
error factors without a change to the file. In a file, a factor is a table, `code_noise = {}` (on, as any
table of parameters is, unless it says `enabled = false`), or a switch, `code_noise = false`.""",
    "vehicle": """What emulator and flight software both know of the craft: its antennas, nominal. Body axes:
x fore, y starboard, z nadir in orbital attitude; origin in the centre of mass.""",
    "structure": """Boxes, panels and joints of the craft, for shadows and reflections. Axes are those of the
vehicle file; every part as it stands when all joints are at zero.""",
}

FLIGHT = """### Policies, navigators, options

What `policy`, `navigator` and `options` of `[craft.flight]` may be with our flight software. A policy decides
which antenna tracks which satellite, a navigator how measurements become a fix; each policy has one. The last
options are those of `patent` alone,
which has no `ionosphere_free`: it commands each satellite on one signal and one channel."""


def page() -> str:
    """The page, Markdown."""
    scenario, *others = ([*_kind(kind)] for kind in KINDS)
    return "\n".join([LEAD, *scenario, *_flight(), *(part for other in others for part in other)])


def _flight() -> list[str]:
    """Policies, navigators and their options, which `[craft.flight]` chooses among."""
    common = of_model(Options)
    rows = [_row(common, common, "", name, value, {}) for name, value in common["properties"].items()]
    for policy in POLICIES.values():
        own = of_model(policy.options)
        further = {
            name: own["properties"][name] for name in own["properties"] if name not in common["properties"]
        }
        rows += [_row(own, own, "", name, value, {}) for name, value in further.items()]
    return [
        f"{FLIGHT}\n\n| policy | who tracks what | navigator | source |\n|---|---|---|---|",
        *(f"| `{p.name}` | {p.summary} | `{p.navigator}` | {p.source} |" for p in POLICIES.values()),
        "\n| navigator | how measurements become a fix | source |\n|---|---|---|",
        *(f"| `{n.name}` | {n.summary} | {n.source} |" for n in NAVIGATORS.values()),
        f"\n{HEAD}",
        *rows,
        "",
    ]


def _kind(kind: str) -> list[str]:
    made = schema(kind)
    shown = examples(kind)
    sections = [_section(made, header, table, shown) for header, table in tables(made)]
    title = f"## The {kind} file\n\n{ABOUT[kind]}\n\nSchema: `{file_name(kind)}`.\n"
    return [title, *(section for section in sections if section)]


def _section(made: dict[str, Any], header: str, table: dict[str, Any], shown: dict[str, Any]) -> str:
    """A table's heading, what it is, and its keys; empty if it holds nothing but other tables."""
    path = header.strip("[]")
    factor = FACTORS.get(path.rsplit(".", 1)[-1]) if ".factors." in header else None
    rows = [
        _row(made, table, path, name, value, shown)
        for name, value in table.get("properties", {}).items()
        if not (factor and name == SWITCH) and table_in(made, value) is None
    ]
    if not rows and factor is None:
        return ""
    heading = [f"### `{header}`\n"] if header else []
    about = [_sentence(table["description"])] if header and table.get("description") else []
    if factor:
        state = "on" if factor.default else "off"
        about += [f"Where no scenario names it: {state}. Source: {factor.source}."]
    keys = "\n".join([HEAD, *rows]) if rows else "No parameters."
    return "\n".join([*heading, *([" ".join(about) + "\n"] if about else []), keys, ""])


def _row(made, table, path: str, name: str, value: dict[str, Any], shown: dict[str, Any]) -> str:
    whole = {**resolved(made, value), **value}
    default = _toml(whole["default"]) if "default" in whole else None
    missing = "**required**" if name in table.get("required", ()) else "optional"
    example = shown.get(f"{path}.{name}".lstrip("."))
    cells = (
        f"`{name}`",
        allowed(made, whole),
        unit(name),
        f"`{default}`" if default else missing,
        f"`{_toml(example)}`" if example is not None and example != whole.get("default") else "",
        _sentence(whole.get("description", "")),
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def allowed(made: dict[str, Any], value: dict[str, Any]) -> str:
    """What a key may hold, in words."""
    if "anyOf" in value:
        return " or ".join(dict.fromkeys(allowed(made, resolved(made, option)) for option in value["anyOf"]))
    if "const" in value:
        return f"`{_toml(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{_toml(one)}`" for one in value["enum"])
    kind = value.get("type")
    if kind == "array":
        return _array(made, value)
    if kind == "object":
        return _free_table(made, value)
    if kind in ("number", "integer"):
        return " ".join(part for part in (kind, _limits(value)) if part)
    if kind == "string" and "pattern" in value:
        return f"string like `{value['pattern']}`"
    return str(kind)


def _array(made: dict[str, Any], value: dict[str, Any]) -> str:
    fixed = value.get("prefixItems")
    if fixed:
        inner = list(dict.fromkeys(allowed(made, resolved(made, one)) for one in fixed))
        return f"[{', '.join(inner)}] ({len(fixed)})" if len(inner) > 1 else f"{len(fixed)} of: {inner[0]}"
    return f"list of: {allowed(made, resolved(made, value.get('items', {})))}"


def _free_table(made: dict[str, Any], value: dict[str, Any]) -> str:
    """A table whose keys are the user's."""
    named = value.get("patternProperties", {})
    if named:
        pattern, inner = next(iter(named.items()))
        return f"table: name like `{pattern}` = {allowed(made, resolved(made, inner))}"
    inner = value.get("additionalProperties")
    return f"table: name = {allowed(made, resolved(made, inner))}" if isinstance(inner, dict) else "table"


def _limits(value: dict[str, Any]) -> str:
    """The range of a number: [ ] for ends that belong to it, ( ) for those that do not."""
    low = value.get("minimum", value.get("exclusiveMinimum"))
    high = value.get("maximum", value.get("exclusiveMaximum"))
    if low is None and high is None:
        return ""
    opening = "[" if "minimum" in value else "("
    closing = "]" if "maximum" in value else ")"
    step = f", in steps of {value['multipleOf']:g}" if "multipleOf" in value else ""
    return f"{opening}{_end(low, '-inf')}, {_end(high, 'inf')}{closing}{step}"


def _end(value: float | None, without: str) -> str:
    if value is None:
        return without
    return "2^63" if value == 2**63 else f"{value:.10g}"


def _sentence(text: str) -> str:
    text = " ".join(text.split())
    return text[:1].upper() + text[1:] + ("" if not text or text[-1] in ".!?" else ".")


def _toml(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(name)} = {_toml(one)}" for name, one in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, (str, bool)) else f"{value}"


def _key(name: str) -> str:
    return name if name.replace("-", "").replace("_", "").isalnum() else json.dumps(name)


if __name__ == "__main__":
    sys.stdout.write(page())
