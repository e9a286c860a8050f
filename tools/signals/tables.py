"""Signals of a recording as tables: all of them in one long table, or a message's side by side."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gnss_hil.tools.recording.formats.piece import Piece
from gnss_hil.tools.results.parquet import Columns, Labelled, Partial
from gnss_hil.tools.signals.database import Database, Message, Signal
from gnss_hil.tools.signals.decode import Column, Undecoded, by_message, columns

FRAMES = 1 << 15
"""Frames whose signals are held at a time."""


DIRECTIONS = ("Rx", "Tx")


class Table(Protocol):
    def pieces(self, piece: Piece) -> Iterator[Columns]:
        """The rows of a piece of the recording, at least one set of columns."""
        ...


class _Texts:
    """The texts of choices: `labels`, and the code of each value."""

    def __init__(self, database: Database):
        self.labels = database.texts
        code = {text: i for i, text in enumerate(self.labels)}
        self._tables: dict[Signal, tuple[NDArray[np.int64], NDArray[np.int64]]] = {}
        for message in database.messages:
            for s in message.signals:
                choices = sorted((raw, text) for raw, text in s.choices if abs(raw) < 2**63)
                if choices:
                    keys = np.array([raw for raw, _ in choices], np.int64)
                    self._tables[s] = keys, np.array([code[text] for _, text in choices])

    def codes(self, s: Signal, raw: NDArray[np.int64]) -> NDArray[np.int64]:
        """(k,) codes of raw values (k,), -1 for those that have no text."""
        table = self._tables.get(s)
        if table is None:
            return np.full(len(raw), -1)
        keys, codes = table
        at = np.minimum(np.searchsorted(keys, raw), len(keys) - 1)
        return np.where(keys[at] == raw, codes[at], -1)


def _buses(piece: Piece) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    names, bus = np.unique(piece.bus, return_inverse=True)
    return bus, tuple(name.decode() for name in names.tolist())


class LongTable:
    """A row for each signal of each frame, frame by frame.

    time, bus, direction, message, signal, value (physical), text (of the value, where there is one), unit
    """

    def __init__(self, database: Database, undecoded: Undecoded):
        self._database = database
        self._undecoded = undecoded
        self._texts = _Texts(database)
        signals = [s for message in database.messages for s in message.signals]
        self._signals = tuple(s.name for s in signals)
        self._units = tuple(dict.fromkeys(s.unit for s in signals)) or ("",)
        self._unit_of = np.array([self._units.index(s.unit) for s in signals], np.int64)
        self._first = np.cumsum([0, *(len(message.signals) for message in database.messages)])

    def pieces(self, piece: Piece) -> Iterator[Columns]:
        for begin in range(0, max(len(piece.frames), 1), FRAMES):
            yield self._rows(piece.rows(slice(begin, begin + FRAMES)))

    def _rows(self, piece: Piece) -> Columns:
        words, n = piece.frames.words, len(piece.frames)
        decoded, count, message = [], np.zeros(n, np.int64), np.zeros(n, np.int64)
        for at, rows in by_message(self._database, piece.frames, self._undecoded):
            found = columns(self._database.messages[at], words[rows], self._undecoded)
            decoded.append((at, rows, found))
            message[rows] = at
            count[rows] = sum((_there(c, len(rows)) for c in found), np.zeros(len(rows), np.int64))
        total = int(count.sum())
        value, text, signal = np.full(total, np.nan), np.full(total, -1), np.zeros(total, np.int64)
        first = np.cumsum(count) - count
        for at, rows, found in decoded:
            place = first[rows]
            for i, column in enumerate(found):
                mine = slice(None) if column.present is None else column.present
                to = place[mine]
                value[to] = column.values[mine]
                signal[to] = self._first[at] + i
                if column.signal.choices:
                    text[to] = self._texts.codes(column.signal, column.raw[mine])
                place = place + _there(column, len(rows))
        bus, names = _buses(piece)
        return {
            "time": np.repeat(piece.unix_us, count).astype("M8[us]"),
            "bus": Labelled(np.repeat(bus, count), names),
            "direction": Labelled(np.repeat(piece.sent, count).astype(np.int64), DIRECTIONS),
            "message": Labelled(np.repeat(message, count), tuple(m.name for m in self._database.messages)),
            "signal": Labelled(signal, self._signals),
            "value": value,
            "text": Labelled(text, self._texts.labels),
            "unit": Labelled(self._unit_of[signal], self._units),
        }


def _there(column: Column, n: int) -> NDArray[np.int64]:
    return np.ones(n, np.int64) if column.present is None else column.present.astype(np.int64)


class MessageTable:
    """A row for each frame of one message: time, bus, direction, signals, `NAME_text` beside some."""

    def __init__(self, database: Database, message: Message, undecoded: Undecoded):
        self._database = Database(database.path, (message,))
        self._texts = _Texts(self._database)
        self._undecoded = undecoded

    def pieces(self, piece: Piece) -> Iterator[Columns]:
        (message,) = self._database.messages
        piece = piece.rows(np.flatnonzero(piece.frames.can_id == message.can_id))
        rows = next(
            (r for _, r in by_message(self._database, piece.frames, self._undecoded)), np.zeros(0, int)
        )
        piece = piece.rows(rows)
        bus, names = _buses(piece)
        table: dict = {
            "time": piece.unix_us.astype("M8[us]"),
            "bus": Labelled(bus, names),
            "direction": Labelled(piece.sent.astype(np.int64), DIRECTIONS),
        }
        for column in columns(message, piece.frames.words, self._undecoded):
            s, there = column.signal, column.present
            table[s.name] = column.values if there is None else Partial(column.values, there)
            if s.choices:
                codes = self._texts.codes(s, column.raw)
                codes = codes if there is None else np.where(there, codes, -1)
                table[f"{s.name}_text"] = Labelled(codes, self._texts.labels)
        yield table
