"""Fault files: TOML with a [[fault]] for each, checked whole at the door; those that ship are the library."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from gnss_hil.dbc.common.faults import faults
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
_ONE: TypeAdapter[Fault] = TypeAdapter(AnyFault)


def load(path: Path) -> FaultFile:
    """A fault file; FaultError lists every mistake in it."""
    return FILES.checked(FILES.read(path), str(path))


def of_line(text: str) -> Fault:
    """A fault of one line; FaultError says what is wrong with it."""
    origin = f"--fault '{text}'"
    try:
        document = grammar.parse(text)
    except ValueError as error:
        raise FaultError(f"{origin}: {error}") from None
    try:
        return _ONE.validate_python(document)
    except ValidationError as error:
        raise FaultError("\n".join(faults(error, origin, KINDS[document["kind"]].params))) from None


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
