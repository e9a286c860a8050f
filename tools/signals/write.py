"""The signals of a recording in a Parquet file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gnss_hil.dbc.contract.frames import EMPTY
from gnss_hil.tools.common.whole_file import draft_of
from gnss_hil.tools.recording.formats.convert import Converted
from gnss_hil.tools.recording.formats.order import in_time_order
from gnss_hil.tools.recording.formats.piece import NAME_BYTES, Piece
from gnss_hil.tools.recording.formats.recording import Recording
from gnss_hil.tools.results import parquet
from gnss_hil.tools.signals.database import Database
from gnss_hil.tools.signals.decode import Undecoded
from gnss_hil.tools.signals.tables import LongTable, MessageTable, Table


@dataclass(slots=True)
class Decoded:
    """rows  of the table;  read  frames, and what was found besides;  undecoded  of the frames"""

    rows: int = 0
    read: Converted = field(default_factory=Converted)
    undecoded: Undecoded = field(default_factory=Undecoded)


def write(
    recording: Recording,
    out: Path,
    database: Database,
    message: str | None,
    progress: Callable[[int, float | None], None] = lambda n, share: None,
) -> Decoded:
    """A table of all signals, or with `message` of that one's; `out` is there whole or not at all."""
    done = Decoded()
    table: Table = LongTable(database, done.undecoded)
    if message is not None:
        table = MessageTable(database, database.named(message), done.undecoded)

    def rows() -> Iterator[parquet.Columns]:
        nothing = Piece(np.zeros(0, np.int64), np.zeros(0, f"S{NAME_BYTES}"), EMPTY, np.zeros(0, bool))
        yield from table.pieces(nothing)  # a file without a frame has the columns, too
        for piece in in_time_order(recording.pieces(), done.read.strayed):
            done.read.add(piece)
            for columns in table.pieces(piece):
                done.rows += len(columns["time"])
                yield columns
            progress(done.read.frames, recording.found.share)

    with draft_of(out) as draft:
        parquet.write(draft, rows())
    done.read.found = recording.found
    return done
