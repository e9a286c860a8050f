"""The tables of a file's model: what stands at a key, which keys there are, which tables have a key."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

Key = str | int


def options(kind: Any) -> list[Any]:
    """The kinds that a value may be of, where several are allowed; None is none of them."""
    origin = get_origin(kind)
    if origin is Annotated:
        return options(get_args(kind)[0])
    if origin in (Union, UnionType):
        return [option for part in get_args(kind) for option in options(part)]
    return [] if kind is NoneType else [kind]


def inside(kind: Any, key: Key) -> Any | None:
    """What stands at a key of a table, or at a number of a list; None if nothing does."""
    for option in options(kind):
        origin, parts = get_origin(option), get_args(option)
        if _is_model(option) and key in option.model_fields:
            return option.model_fields[key].annotation
        if _is_list(option) and isinstance(key, int) and key >= 0:
            if origin is list or parts[-1] is Ellipsis:
                return parts[0]
            return parts[key] if key < len(parts) else None
        if origin in (dict, Mapping) and isinstance(key, str):
            return parts[1]
    return None


def tagged(kind: Any, tag: Key) -> Any | None:
    """Of several tables that a value may be, the one whose key that tells them apart has this value."""
    several = options(kind)
    for option in several if len(several) > 1 else ():
        if _is_model(option) and any(
            get_origin(field.annotation) is Literal and get_args(field.annotation) == (tag,)
            for field in option.model_fields.values()
        ):
            return option
    return None


def at(kind: Any, keys: Sequence[Key]) -> Any | None:
    """What stands at a path of keys."""
    for key in keys:
        kind = inside(kind, key)
        if kind is None:
            return None
    return kind


def keys_of(kind: Any) -> list[str]:
    """The keys of a table; none where any are allowed."""
    found = (name for option in options(kind) if _is_model(option) for name in option.model_fields)
    return list(dict.fromkeys(found))


def row_of(kind: Any) -> Any | None:
    """What the rows of a list of tables are; None for anything else."""
    for option in options(kind):
        if _is_list(option) and any(_is_model(part) for part in options(get_args(option)[0])):
            return get_args(option)[0]
    return None


def is_table(kind: Any) -> bool:
    return any(_is_model(option) or get_origin(option) in (dict, Mapping) for option in options(kind))


def is_list(kind: Any) -> bool:
    return any(_is_list(option) for option in options(kind))


def is_text(kind: Any) -> bool:
    """Whether nothing but text stands there."""
    found = options(kind)
    return bool(found) and all(map(_is_word, found))


def _is_word(option: Any) -> bool:
    if get_origin(option) is Literal:
        return all(isinstance(word, str) for word in get_args(option))
    return option is str


def values(model: type[BaseModel]) -> Iterator[tuple[tuple[Key, ...], Any]]:
    """Path and kind of everything in a model that is no table, rows of lists of tables as number 0."""
    for name, field in model.model_fields.items():
        yield from _values((name,), field.annotation)


def _values(path: tuple[Key, ...], kind: Any) -> Iterator[tuple[tuple[Key, ...], Any]]:
    row = row_of(kind)
    if row is not None:
        yield from _values((*path, 0), row)
        return
    models = [option for option in options(kind) if _is_model(option)]
    for model in models:
        for name, field in model.model_fields.items():
            yield from _values((*path, name), field.annotation)
    if not models:
        yield path, kind


def header(path: Sequence[Key]) -> str:
    """A table's heading in a file: [craft.orbit] for craft, 0, orbit."""
    return f"[{'.'.join(key for key in path if isinstance(key, str))}]"


def elsewhere(model: type[BaseModel], key: str) -> list[str]:
    """Headings of the tables of a model that have a key."""
    found = [path[:-1] for path in _tables(model) if path[-1] == key]
    return list(dict.fromkeys(header(path) if path else "the file's beginning" for path in found))


def _tables(model: type[BaseModel], path: tuple[Key, ...] = ()) -> Iterator[tuple[Key, ...]]:
    """Paths of all keys, tables' own too."""
    for name, field in model.model_fields.items():
        yield (*path, name)
        row = row_of(field.annotation)
        below = (*path, name) if row is None else (*path, name, 0)
        for option in options(field.annotation if row is None else row):
            if _is_model(option):
                yield from _tables(option, below)


def _is_model(option: Any) -> bool:
    return isinstance(option, type) and issubclass(option, BaseModel)


def _is_list(option: Any) -> bool:
    return get_origin(option) in (list, tuple)
