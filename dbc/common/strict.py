"""Models of files: unknown keys are mistakes, and nothing is coerced."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler
from pydantic_core import CoreSchema


def _strict_numbers(schema: Any) -> None:
    """Makes what a schema says of numbers and switches strict, in place, however deep it says it."""
    if isinstance(schema, dict):
        if schema.get("type") in ("float", "int", "bool"):
            schema["strict"] = True
        for part in schema.values():
            _strict_numbers(part)
    elif isinstance(schema, list | tuple):
        for part in schema:
            _strict_numbers(part)


class Strict(BaseModel):
    """Unknown keys are mistakes; numbers are finite; nothing is coerced from text."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Numbers and switches have to be that in the file: "600" is text, 600 serves as 600.0, true is no
        number. Lists still serve as tuples, as TOML has no others."""
        made = handler(source)
        _strict_numbers(made)
        return made
