"""Fault files: TOML with a [[fault]] for each, checked whole at the door; those that ship are the library."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from gnss_hil.dbc.common.faults import faults
from gnss_hil.dbc.common.near import hint
from gnss_hil.dbc.common.shipped_files import Files
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.faults import grammar
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.models import Fault, FaultError
from gnss_hil.emulator.faults.spoken import Line

_Any: Any = reduce(or_, (row.params for row in KINDS.values()))


AnyFault = Annotated[Annotated[_Any, Field(discriminator="kind")], Line(grammar.parse)]
"""A fault of any kind, by its `kind`; a line of text too."""


class FaultFile(Strict):
    """Faults of a run.

    description   what is to be seen
    fault         tables [[fault]], or lines of text: fault = ["rx2 off @2m+30s"]
    """

    description: str = ""
    fault: tuple[AnyFault, ...]

    @model_validator(mode="after")
    def _has_some(self):
        if not self.fault:
            raise ValueError('no fault; [[fault]], or fault = ["rx2 off @2m+30s"]')
        return self


FILES = Files("fault file", "gnss_hil.emulator.data", "faults", FaultFile, FaultError)
shipped = FILES.shipped


def load(path: Path) -> FaultFile:
    """A fault file; FaultError lists every mistake in it."""
    return FILES.checked(FILES.read(path), str(path))


def of_line(text: str) -> Fault:
    """A fault of one line; FaultError with every mistake in it."""
    origin = f"--fault '{text}'"
    document, said = grammar.read(text)
    if "kind" not in document:
        said += grammar.of_place_and_time(document)
    wrong = [f"{origin}: {line}" for line in said]
    if "kind" in document:
        try:
            fault = KINDS[document["kind"]].params.model_validate(document)
            if not wrong:
                return fault
        except ValidationError as error:
            told = faults(error, origin, KINDS[document["kind"]].params, whole="")
            wrong += [line for line in told if not (wrong and line.endswith(": missing"))]
    raise FaultError("\n".join(wrong))


def is_line(text: str) -> bool:
    """Whether an argument is a fault itself, and no file."""
    return " " in text and not Path(text).exists()


def check_quoted(given: Sequence[str]) -> None:
    """FaultError if arguments are words of one fault that was typed without quotes, or files that are none:
    those that ship are told once."""
    known = shipped()
    words = [text for text in given if not is_line(text)]
    strange = [text for text in words if not Path(text).is_file() and text.removesuffix(".toml") not in known]
    if len(words) > 1 and any(map(grammar.is_spoken, strange)):
        line = " ".join(words)
        raise FaultError(f"{line}: a fault of several words is one argument, in quotes: '{line}'")
    if len(strange) > 1:
        told = [f"fault file '{text}': no such file{hint(text, known)}" for text in strange]
        raise FaultError("\n".join([*told[:-1], f"{told[-1]}; shipped are {', '.join(known)}"]))


def gathered(paths: Sequence[Path], lines: Sequence[str]) -> tuple[Fault, ...]:
    """Faults of files and lines, in this order; FaultError with every mistake of all of them."""
    found: list[Fault] = []
    wrong: list[str] = []
    for path in paths:
        try:
            found += load(FILES.find(str(path))).fault
        except FaultError as error:
            wrong.append(str(error))
    for text in lines:
        try:
            found.append(of_line(text))
        except FaultError as error:
            wrong.append(str(error))
    if wrong:
        raise FaultError("\n".join(wrong))
    return tuple(found)
