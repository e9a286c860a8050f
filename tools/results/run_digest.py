"""The digests of a run's buses and its channel table: made while the run goes on, or from its log."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.decoder.block import Columns
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.recording.formats.candump import read_chunks
from gnss_hil.tools.results import tables

CHANNELS = "channels.parquet"


def bus_names(craft: Sequence[str]) -> list[str]:
    """Names of the buses in bus.log: can0 is the first craft's."""
    return [f"can{i}" for i in range(len(craft))]


def feed_log(path: Path, buses: Sequence[str], feed: Callable[[int, FrameBatch], None]) -> None:
    """Hands over the frames of a log by the number of their bus, piece by piece."""
    with Path(path).open("rb") as log:
        for _, names, frames, _ in read_chunks(log, path.name):
            for number, bus in enumerate(buses):
                mine = names == bus.encode()
                feed(number, frames if mine.all() else frames[mine])


class RunDigest:
    """What the buses of a run amount to, one bus for each craft.

    folder  of the run, in which channels.parquet grows; None to keep no channel table
    """

    def __init__(self, folder: Path | None, craft: Sequence[str], codecs: Sequence[Codec]):
        self._table = table = None if folder is None else tables.ParquetTable(folder / CHANNELS)
        self._craft = tuple(craft)
        self._digests = [
            Digest(codec, None if table is None else _taker(table, section, name))
            for section, (name, codec) in enumerate(zip(craft, codecs, strict=True))
        ]

    def feed(self, bus: int, frames: FrameBatch, bits: NDArray[np.int64] | None = None) -> None:
        """Frames (n,) of a bus in its order, and their bits (n,) on the wire if they are known already."""
        self._digests[bus].feed(frames, bits)

    def finish(self) -> dict[str, Digest]:
        """Digests by craft; the channel table is in place."""
        for digest in self._digests:
            digest.finish()
        if self._table is not None:
            self._table.close()
        return dict(zip(self._craft, self._digests, strict=True))

    def discard(self) -> None:
        """Leave no unfinished table behind."""
        if self._table is not None:
            self._table.discard()


def _taker(table: tables.ParquetTable, section: int, craft: str) -> Callable[[Columns], None]:
    return lambda channels: table.add(tables.columns_of(tables.CHANNELS, craft, channels), section)


def from_log(path: Path, craft: Sequence[str], codecs: Sequence[Codec]) -> dict[str, Digest]:
    """The digests by craft of a log in its run folder, and channels.parquet beside it."""
    tables.remove_parts(path.parent)
    run = RunDigest(path.parent, craft, codecs)
    try:
        feed_log(path, bus_names(craft), run.feed)
        return run.finish()
    finally:
        run.discard()
