"""Tables that may be written as text, and lists of one: how they are read, and what a schema says of them."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema, core_schema

from gnss_hil.dbc.common.vehicle import Strict


class Spoken(Strict):
    """A table, or text that stands for it."""

    @classmethod
    @abstractmethod
    def _read(cls, text: str) -> dict[str, Any]:
        """The table of a text; ValueError if it stands for none."""

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, value: Any) -> Any:
        return cls._read(value) if isinstance(value, str) else value

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, handler(core)]}


class OneOrMore:
    """Marks a list that may be written as its only member."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(_listed, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        made = handler(core)
        return {"anyOf": [made["items"], made]}


def _listed(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else [value]


class Line:
    """Marks a table that may be written as a line of text, as a function reads it."""

    def __init__(self, read):
        self._read = read

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self._table, handler(source))

    def _table(self, value: Any) -> Any:
        return self._read(value) if isinstance(value, str) else value

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, handler(core)]}
