"""Columns to and from Parquet files, by Arrow's Rust library: a fifth of what a data frame library weighs.

A column is an array (n,), of times too, `Labelled` text, or `Partial`. Numbers that are nan become nulls in a
file, and nulls nan.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

BATCH_ROWS = 1 << 16
"""Rows that are held while a file is read or written."""

_MAGIC = b"PAR1"
_FOOTER_BYTES = 8  # length of the metadata, then the magic again
_PANICS = "pyo3_runtime"
"""Module of the exception that a panic of a Rust library raises (PyO3 user guide, "Error handling")."""


class Damaged(ValueError):
    """A file that is no Parquet file, or one without the columns; the message is for people."""


@dataclass(frozen=True, slots=True, eq=False)
class Labelled:
    """A column of text: codes (n,), and the label of each code; -1 is none."""

    codes: NDArray[np.integer]
    labels: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.codes)

    def __getitem__(self, rows) -> Labelled:
        return Labelled(self.codes[rows], self.labels)


@dataclass(frozen=True, slots=True, eq=False)
class Partial:
    """A column of values (n,), of which those that are not present (n,) are nulls."""

    values: NDArray
    present: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, rows) -> Partial:
        return Partial(self.values[rows], self.present[rows])


Column = NDArray | Labelled | Partial
Columns = Mapping[str, Column]


def write(path: Path, pieces: Iterable[Columns]) -> None:
    """A table of pieces with the same columns, one after the other; at least one.

    What the pieces raise comes through as it is, not as what the library makes of it.
    """
    from arro3.core import RecordBatchReader
    from arro3.io import write_parquet

    faults: list[BaseException] = []
    tables = (_table(piece) for piece in _watched(pieces, faults))
    first = next(tables)
    batches = (batch for table in chain([first], tables) for batch in table.to_batches())
    # Measured on tables of a run: a dictionary costs 1.5 times more time for numbers, and gains nothing.
    text: dict = {name: True for name, kind in zip(first.column_names, first.schema.types, strict=True)
            if _is_text(kind)}  # fmt: skip
    try:
        write_parquet(
            RecordBatchReader.from_batches(first.schema, batches), path,
            compression="zstd(1)", dictionary_enabled=False, column_dictionary_enabled=text,
            max_row_group_size=BATCH_ROWS,
        )  # fmt: skip
    except BaseException as error:
        raise faults[0] if faults else error  # noqa: B904


def _watched(pieces: Iterable[Columns], faults: list[BaseException]) -> Iterator[Columns]:
    try:
        yield from pieces
    except BaseException as error:
        faults.append(error)
        raise


def join(path: Path, parts: Iterable[Path]) -> None:
    """One table of files with the same columns, one after the other; at least one."""
    write(path, chain.from_iterable(_batches(part, None, _as_written) for part in parts))


def read(path: Path, names: Sequence[str] | None = None) -> Iterator[dict[str, Column]]:
    """The columns of a file, all or some, in batches of rows; Damaged if it cannot be read."""
    return _batches(path, names, _numbers)


def _batches(
    path: Path, names: Sequence[str] | None, column_of: Callable[..., Column]
) -> Iterator[dict[str, Column]]:
    from arro3.io import read_parquet

    _check(path)
    with _damage(path):
        reader = read_parquet(path, batch_size=BATCH_ROWS)
    names = reader.schema.names if names is None else names
    missing = set(names) - set(reader.schema.names)
    if missing:
        raise Damaged(f"{path}: has no column {', '.join(sorted(missing))}")
    with _damage(path):
        for batch in reader:
            yield {name: column_of(batch.column(name)) for name in names}


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """Damaged for what the library cannot understand; what is no fault of the file passes."""
    try:
        yield
    except (OSError, MemoryError):
        raise
    except Exception as error:
        line, _, _ = str(error).partition("\n")
        raise Damaged(f"{path}: {line or type(error).__name__}") from None
    except BaseException as error:
        # The library panics at a footer that it does not understand: no Exception, and no class to import.
        if type(error).__module__ != _PANICS:
            raise
        raise Damaged(f"{path}: not a Parquet file, or damaged") from None


def _check(path: Path) -> None:
    """Damaged if a file is cut short or something else: what a crash leaves."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - _FOOTER_BYTES))
        end = file.read()
    if end[4:] != _MAGIC or int.from_bytes(end[:4], "little") + _FOOTER_BYTES + len(_MAGIC) > size:
        raise Damaged(f"{path}: not a Parquet file, or cut short")


def _table(columns: Columns):
    from arro3.core import Table

    return Table.from_pydict({name: _array(column) for name, column in columns.items()})


def _array(column: Column):
    """An Arrow array."""
    from arro3.core import Array, DataType

    if isinstance(column, Labelled):
        labels = Array(list(column.labels), type=DataType.utf8())
        if len(column) and column.codes.min() < 0:
            return _taken(labels, column.codes, column.codes >= 0)
        return labels.take(Array.from_numpy(np.ascontiguousarray(column.codes)))
    if isinstance(column, Partial):
        return _taken(_array(column.values), np.arange(len(column)), column.present)
    column = np.asarray(column)
    if column.dtype.kind == "M":
        return Array.from_numpy(column).cast(DataType.timestamp("us", tz="UTC"))
    if column.dtype.kind == "U":
        labels, codes = np.unique(column, return_inverse=True)
        return _array(Labelled(codes, tuple(labels.tolist())))
    if column.dtype.kind == "f" and np.isnan(column).any():
        return _taken(Array.from_numpy(column), np.arange(len(column)), ~np.isnan(column))
    return Array.from_numpy(np.ascontiguousarray(column))


def _taken(array, places: NDArray, present: NDArray[np.bool_]):
    """An array's values at places (n,), nulls where they are not present: nan, cast to integers, is null."""
    from arro3.core import Array, DataType

    return array.take(Array.from_numpy(np.where(present, places, np.nan)).cast(DataType.int64()))


def _is_text(kind) -> bool:
    from arro3.core import DataType

    return DataType.is_string(kind) or DataType.is_large_string(kind) or DataType.is_string_view(kind)


def _numbers(array) -> Column:
    """Numbers or codes of an Arrow array, nan for null."""
    from arro3.core import DataType, dictionary_dictionary, dictionary_indices

    if _is_text(array.type):
        coded = array.cast(DataType.utf8()).cast(DataType.dictionary(DataType.int32(), DataType.utf8()))
        return Labelled(dictionary_indices(coded).to_numpy(), tuple(dictionary_dictionary(coded).to_pylist()))
    return np.array(array.to_pylist(), float) if array.null_count else array.to_numpy()


def _as_written(array) -> Column:
    """The column that an Arrow array was made of: nulls of whole numbers and truths stay what they are."""
    if not array.null_count or _is_text(array.type):
        return _numbers(array)
    present = np.array([value is not None for value in array.to_pylist()])
    there = _taken(array, np.flatnonzero(present), np.ones(present.sum(), bool)).to_numpy()
    if there.dtype.kind == "f":
        return _numbers(array)
    values = np.zeros(len(present), there.dtype)
    values[present] = there
    return Partial(values, present)


def of_craft(path: Path, craft: str, names: Sequence[str]) -> dict[str, NDArray]:
    """Columns of numbers of one craft's rows, whole; Damaged if the file cannot be read."""
    pieces = [_rows_of(batch, craft, names) for batch in read(path, ("craft", *names))]
    none = [np.zeros(0)] if not pieces else []
    return {name: np.concatenate(none + [piece[name] for piece in pieces]) for name in names}


def batches_of_craft(path: Path, craft: str, names: Sequence[str]) -> Iterator[dict[str, Column]]:
    """The same piece by piece, text too; pieces without a row of the craft are left out."""
    for batch in read(path, ("craft", *names)):
        rows = _rows_of(batch, craft, names)
        if len(rows[names[0]]):
            yield rows


def numbers(batch: Columns, name: str) -> NDArray:
    """A column of numbers (n,)."""
    column = batch[name]
    assert isinstance(column, np.ndarray)
    return column


def text(batch: Columns, name: str) -> Labelled:
    """A column of text (n,)."""
    column = batch[name]
    assert isinstance(column, Labelled)
    return column


def _rows_of(batch: Columns, craft: str, names: Sequence[str]) -> dict:
    owner = text(batch, "craft")
    mine = np.array([label == craft for label in owner.labels], bool)[owner.codes]
    if mine.all():
        return {name: batch[name] for name in names}
    return {name: batch[name][mine] for name in names}
