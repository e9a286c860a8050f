"""docs/scenario.md: the words of `page.md`, and in its places every key of the files a user writes.

python -m gnss_hil.tools.schema.page > docs/scenario.md
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from importlib import resources
from typing import Any

from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.flightsw.assignment.registry import POLICIES
from gnss_hil.flightsw.estimation.registry import NAVIGATORS
from gnss_hil.tools.schema.examples import examples
from gnss_hil.tools.schema.json_schema import KINDS, Schema, resolved, schema, table_in, tables
from gnss_hil.tools.schema.units import unit

SWITCH = "enabled"
"""The key that every factor has; described once, not in each table."""

_HEAD = ("key", "value", "unit", "default", "example", "meaning")
_PLACE = re.compile(r"^\{\{(\w+)\}\}$", re.MULTILINE)


def page() -> str:
    """The page, Markdown."""
    words = resources.files("gnss_hil.tools.schema").joinpath("page.md").read_text("utf-8")
    return _PLACE.sub(lambda place: _PARTS[place[1]](), words)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    top, rule, *body = ["| " + " | ".join(line) + " |" for line in lines]
    return "\n".join([top, rule.replace(" ", ""), *body])


def _kind(kind: str) -> str:
    """Keys of a kind of file, a section for each table."""
    made, shown = schema(kind), examples(kind)
    sections = (_section(made, header, table, shown) for header, table in tables(made))
    return "\n\n".join(filter(None, sections))


_PARTS: dict[str, Callable[[], str]] = {
    **{kind: lambda kind=kind: _kind(kind) for kind in KINDS},
    "policies": lambda: _table(
        ("policy", "who tracks what", "navigator", "source"),
        ((f"`{p.name}`", p.summary, f"`{p.navigator}`", p.source) for p in POLICIES.values()),
    ),
    "navigators": lambda: _table(
        ("navigator", "how measurements become a fix", "source"),
        ((f"`{n.name}`", n.summary, n.source) for n in NAVIGATORS.values()),
    ),
}
"""What may stand in a place."""


def _section(made: Schema, header: str, table: Schema, shown: dict[str, Any]) -> str:
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
    about = [_sentence(table["description"])] if header and table.get("description") else []
    if factor:
        state = "on" if factor.default else "off"
        about += [f"Where no scenario names it: {state}. Source: {factor.source}."]
    heading = f"### `{header}`" if header else ""
    keys = _table(_HEAD, rows) if rows else "No parameters."
    return "\n\n".join(filter(None, (heading, " ".join(about), keys)))


def _row(
    made: Schema, table: Schema, path: str, name: str, value: Schema, shown: dict[str, Any]
) -> tuple[str, ...]:
    whole = {**resolved(made, value), **value}
    default = _toml(whole["default"]) if "default" in whole else None
    missing = "**required**" if name in table.get("required", ()) else "optional"
    example = shown.get(f"{path}.{name}".lstrip("."))
    return (
        f"`{name}`",
        allowed(made, whole),
        unit(name),
        f"`{default}`" if default else missing,
        f"`{_toml(example)}`" if example is not None and example != whole.get("default") else "",
        _sentence(whole.get("description", "")),
    )


def allowed(made: Schema, value: Schema) -> str:
    """What a key may hold, in words."""

    def inner(node: Schema) -> str:
        return allowed(made, resolved(made, node))

    match value:
        case {"anyOf": options}:
            return " or ".join(dict.fromkeys(map(inner, options)))
        case {"const": constant}:
            return f"`{_toml(constant)}`"
        case {"enum": choices}:
            return ", ".join(f"`{_toml(one)}`" for one in choices)
        case {"type": "array", "prefixItems": fixed}:
            kinds = list(dict.fromkeys(map(inner, fixed)))
            return (
                f"[{', '.join(kinds)}] ({len(fixed)})" if len(kinds) > 1 else f"{len(fixed)} of: {kinds[0]}"
            )
        case {"type": "array"}:
            return f"list of: {inner(value.get('items', {}))}"
        case {"type": "object", "patternProperties": named} if named:
            pattern, node = next(iter(named.items()))
            return f"table: name like `{pattern}` = {inner(node)}"
        case {"type": "object", "additionalProperties": dict(node)}:
            return f"table: name = {inner(node)}"
        case {"type": "object"}:
            return "table"
        case {"type": "number" | "integer" as kind}:
            return f"{kind} {_limits(value)}".rstrip()
        case {"type": "string", "pattern": pattern}:
            return f"string like `{pattern}`"
    return str(value.get("type"))


def _limits(value: Schema) -> str:
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
