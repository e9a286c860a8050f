"""Kinds of faults in words: for `gnss-hil faults show`, and the tables of docs/faults.md.

python -m gnss_hil.tools.schema.fault_page > docs/faults.md
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from importlib import resources

from gnss_hil.emulator.faults import files
from gnss_hil.emulator.faults.checks import CHECKS
from gnss_hil.emulator.faults.kinds.registry import GROUPS
from gnss_hil.emulator.faults.kinds.row import LINKS, Row
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.tools.schema.json_schema import Schema, of_model, resolved
from gnss_hil.tools.schema.page import allowed

_PLACE = re.compile(r"^\{\{(\w+)\}\}$", re.MULTILINE)


def own_keys(row: Row) -> list[tuple[str, str, str, str]]:
    """Of a kind beyond what all have: key, what it may be, its default, its meaning."""
    made = of_model(row.params)
    names = [name for name in row.params.model_fields if name not in Fault.model_fields]
    return [
        (name, *_said(made, made["properties"][name], name in made.get("required", ()))) for name in names
    ]


def _said(made: Schema, value: Schema, required: bool) -> tuple[str, str, str]:
    whole = {**resolved(made, value), **value}
    default = "required" if required else str(whole.get("default", "")).lower() or "-"
    return allowed(made, whole).replace("`", ""), default, " ".join(whole.get("description", "").split())


def described(row: Row) -> str:
    """A kind in full, for a terminal."""
    lead = " ".join(of_model(row.params).get("description", "").split())
    keys = own_keys(row)
    width = max((len(key[0]) for key in keys), default=0)
    lines = [
        f"{row.name}: {row.summary}",
        "",
        *([f"  {lead}"] if lead else []),
        *([f"  {row.detail}"] if row.detail else []),
        *([""] if keys else []),
        *(f"  {name:<{width}}  {kind} ({default})  {meaning}" for name, kind, default, meaning in keys),
        "",
        f"  example  --fault '{row.example}'",
        *([f"  words    {', '.join(row.words)}"] if row.words else []),
        f"  links    {', '.join(row.links) or 'none'}",
        *([f"           not {' nor '.join(_missing(row))}: {row.why}"] if _missing(row) else []),
    ]
    return "\n".join(lines)


def _missing(row: Row) -> list[str]:
    return [link for link in LINKS if link not in row.links]


def _kinds() -> str:
    """The table of kinds, a section for each group."""
    return "\n\n".join(
        f"### {group[:1].upper()}{group[1:]}\n\n{_group(rows)}" for group, rows in GROUPS.items()
    )


def _group(rows: tuple[Row, ...]) -> str:
    lines = ["| kind | what it does | keys (default) | in one line | links |", "|---|---|---|---|---|"]
    return "\n".join([*lines, *(_row(row) for row in rows)])


def _row(row: Row) -> str:
    keys = ", ".join(f"`{name}` ({default})" for name, _, default, _ in own_keys(row))
    line = row.example.replace("|", "\\|")
    return f"| `{row.name}` | {row.summary} | {keys} | `{line}` | {', '.join(row.links) or row.why} |"


def _library() -> str:
    """The files that ship."""
    lines = ["| file | faults | what is to be seen |", "|---|---|---|"]
    return "\n".join([*lines, *_files()])


def _files() -> Iterator[str]:
    from gnss_hil.emulator.faults.grammar import line

    for name, path in files.shipped().items():
        found = files.load(path)
        said = "<br>".join(f"`{line(one)}`" for one in found.fault)
        yield f"| `{name}` | {said} | {found.description} |"


def _checks() -> str:
    """Names of what a flight software may see."""
    return "\n".join(
        ["| check | what is seen |", "|---|---|", *(f"| `{k}` | {v} |" for k, v in CHECKS.items())]
    )


_PARTS = {"kinds": _kinds, "library": _library, "checks": _checks}


def page() -> str:
    """docs/faults.md."""
    words = resources.files("gnss_hil.tools.schema").joinpath("faults.md").read_text("utf-8")
    return _PLACE.sub(lambda place: _PARTS[place[1]](), words)


if __name__ == "__main__":
    sys.stdout.write(page())
