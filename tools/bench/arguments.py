"""What a program asks for, as words of the command line: the same parser, limits and messages; and the line
that repeats the run."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike, fspath
from typing import Any

from gnss_hil.dbc.process.command_line import Value
from gnss_hil.tools.bench.errors import BenchError

PathName = str | PathLike[str]
Program = str | Sequence[PathName]
"""Whose software is on a side: "ours", "external", a command line, or the words of one."""

_ONE = ("interval", "seed", "pace", "bus", "policy", "navigator", "vehicle", "autonomous", "obs", "reference")
_EACH = ("nav", "sp3", "on", "off")


def words(scenario: PathName, asked: Mapping[str, Any]) -> list[str]:
    """Words of `gnss-hil run`; what is None or empty is not said.

    asked   by the names of `gnss_hil.run`'s parameters
    """
    return [fspath(scenario), *_options(asked)]


def _options(asked: Mapping[str, Any]) -> Iterator[str]:
    if asked["duration"] is not None:
        yield f"--duration={asked['duration']}"
    for name in _ONE:
        if asked[name] is not None:
            yield f"--{name}={_text(asked[name])}"
    for name in _EACH:
        for value in _several(name, asked[name]):
            yield f"--{name}={_text(value)}"
    if asked["ionosphere_free"]:
        yield "--ionosphere-free"
    for key, value in asked["options"].items():
        yield f"--option={key}={option_text(value)}"
    for key, value in asked["set"].items():
        yield f"--set={key}={value if isinstance(value, str) else toml_value(value)}"
    for fault in _several("faults", asked["faults"]):
        yield f"--faults={fspath(fault)}" if _is_file(fault) else f"--fault={fault}"
    for side in ("flight", "emulator"):
        if asked[side] is not None:
            yield f"--{side}={command_of(asked[side])}"


def _several(name: str, values: Iterable[Any]) -> Iterable[Any]:
    """A word alone would be taken for its letters."""
    if isinstance(values, str | PathLike):
        raise BenchError(f"{name}={fspath(values)!r}: a list of them, as in {name}=[{fspath(values)!r}]")
    return values


def _is_file(fault: PathName) -> bool:
    """Whether a fault is a file of them, not one in a line."""
    return isinstance(fault, PathLike) or fault.endswith(".toml")


def _text(value: Any) -> str:
    return fspath(value) if isinstance(value, PathLike) else str(value)


def command_of(program: Program) -> str:
    """A command line of a program's words; a text is one already."""
    return program if isinstance(program, str) else shlex.join(fspath(word) for word in program)


def option_text(value: Value) -> str:
    """An option's value as a command line has it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def toml_value(value: Any) -> str:
    """A value as TOML has it behind an equals sign, tables inline."""
    match value:
        case Mapping():
            return "{" + ", ".join(f"{toml_value(k)} = {toml_value(v)}" for k, v in value.items()) + "}"
        case str() | PathLike():
            # JSON's escapes are TOML's, but for the one control character that JSON leaves as it is.
            return json.dumps(fspath(value), ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return str(value).lower()
        case list() | tuple():
            return f"[{', '.join(map(toml_value, value))}]"
    return str(value)
