"""What a policy or a navigator may declare as options of its own, beside those of all flights.

All end in one flat set, so what one row declares reaches the rooms of the others. A row may add options and
may narrow those of all flights; it may neither make something else of them nor hide what the set does.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Literal, get_args, get_origin

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from gnss_hil.dbc.common.vehicle import Strict

_BOUNDS = ("gt", "ge", "lt", "le")

_MEANT_TO_BE_SET = {"model_config", "model_post_init"}
"""Members of models that every model may have its own of."""


def own_options(row: str, own: type[Strict], common: type[Strict]) -> type[Strict]:
    """The model of a row's options, if it may stand beside `common`, that of all flights.

    row   what it is called in messages
    ValueError has a line for each field or member that may not, with the row.
    """
    if not (isinstance(own, type) and issubclass(own, Strict)):
        raise ValueError(f"{row}: options: {own!r} is no subclass of Strict")
    if faults := _faults(own, common):
        raise ValueError("\n".join(f"{row}: {name}: {fault}" for name, fault in faults))
    return own


@cache
def _faults(own: type[Strict], common: type[Strict]) -> tuple[tuple[str, str], ...]:
    """Names, and what is wrong with them."""
    config = [
        ("model_config", f"{name} has to be {value!r}, as of Strict")
        for name, value in Strict.model_config.items()
        if own.model_config.get(name) != value
    ]
    added = [base for base in own.__mro__ if base not in common.__mro__]
    members = {name for base in added for name in vars(base) if name[0] != "_"} - _MEANT_TO_BE_SET
    hidden = [
        (name, "hides what the options of all flights call so")
        for name in sorted(members | own.model_fields.keys())
        if hasattr(common, name)
    ]
    widened = [
        (name, "is an option of all flights, which can be narrowed only")
        for name in own.model_fields
        if name in common.model_fields and not _narrows(name, own.model_fields[name], common)
    ]
    return (*config, *hidden, *widened)


def _narrows(name: str, own: FieldInfo, common: type[Strict]) -> bool:
    """Whether a field has no values but such as `common` has: some of them by name, or of the same type
    within bounds of the same kinds."""
    field = common.model_fields[name]
    if not own.is_required() and not _has(common, name, own.get_default(call_default_factory=True)):
        return False
    if get_origin(own.annotation) is Literal:
        return all(_has(common, name, value) for value in get_args(own.annotation))
    kinds, needed = ({type(limit) for limit in each.metadata} for each in (own, field))
    new = [limit for limit in own.metadata if limit not in field.metadata]
    bounds = [getattr(limit, bound) for limit in new for bound in _BOUNDS if hasattr(limit, bound)]
    return (
        own.annotation == field.annotation
        and kinds >= needed
        and all(_has(common, name, bound) for bound in bounds)
    )


def _has(common: type[Strict], name: str, value: Any) -> bool:
    """Whether an option of all flights may have this value."""
    try:
        common.model_validate({name: value})
    except ValidationError:
        return False
    return True
