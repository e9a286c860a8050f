"""Whole chunks of an ASC file at a time: the classical data frames that most of its lines are.

    0.000111 1  101             Rx   d 8 8A 00 03 04 05 06 07 FF  Length = 240000 BitCount = 124 ID = 257

Lines are cut into words by array arithmetic; a word is read from its last character backwards, all lines at
once. What a line has to be is tested as it is read; lines that are anything else are left to `events`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, WIDTH

_BLANK = np.zeros(256, bool)
_BLANK[list(b" \t\r\n")] = True
_NIBBLE = np.full(256, -1, np.int64)
_NIBBLE[list(b"0123456789ABCDEF")] = range(16)
_NIBBLE[list(b"abcdef")] = range(10, 16)
_DIGIT = np.where(_NIBBLE < 10, _NIBBLE, -1)
_PAIR = np.where(np.minimum(_NIBBLE[:, None], _NIBBLE) < 0, -1, _NIBBLE[:, None] << 4 | _NIBBLE)
_PAIR = _PAIR.astype(np.int16).ravel()
"""Value of two digits, by their characters, the first one high."""
_VALUES = {16: _NIBBLE, 10: _DIGIT}
_CHANNEL, _ID, _DIR, _TYPE, _DLC, _DATA = 1, 2, 3, 4, 5, 6
"""Which word is what; 0 is the time."""
_LONGEST_FRACTION = 9
MOST_S = 4_000_000_000
"""No time is longer."""


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """n lines of a chunk of text.

    begin, end  (n,) of each line in the chunk, without its newline
    framed      (n,) whether it is a classical data frame; only then the rest holds
    t_ns        (n,) its time [ns]
    channel     (n,) from 0
    can_id, length, data, sent   (n,), (n,), (n, 8), (n,)
    """

    begin: NDArray[np.int64]
    end: NDArray[np.int64]
    framed: NDArray[np.bool_]
    t_ns: NDArray[np.int64]
    channel: NDArray[np.int64]
    can_id: NDArray[np.uint32]
    length: NDArray[np.uint8]
    data: NDArray[np.uint8]
    sent: NDArray[np.bool_]


def parse(text: bytes, base: int) -> Lines:
    """The lines of a chunk that ends with a newline; numbers are of this base."""
    raw = np.frombuffer(text, np.uint8)
    end = np.flatnonzero(raw == ord("\n"))
    begin = np.r_[0, end[:-1] + 1]
    n = len(end)
    lines = Lines(
        begin, end, np.zeros(n, bool), np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.uint32),
        np.zeros(n, np.uint8), np.zeros((n, WIDTH), np.uint8), np.zeros(n, bool),
    )  # fmt: skip
    edge = np.diff(_BLANK[raw].view(np.int8), prepend=1, append=1)
    starts, stops = np.flatnonzero(edge < 0), np.flatnonzero(edge > 0)
    first = np.searchsorted(starts, begin)
    words = np.diff(first, append=len(starts))
    row = np.flatnonzero(words > _DLC)
    if len(row):
        _fill(lines, row, raw, _Words(raw, starts, stops, first[row], words[row]), base)
    return lines


@dataclass(frozen=True, slots=True, eq=False)
class _Words:
    """The words of k lines: all words' places in the text, and which are each line's."""

    raw: NDArray[np.uint8]
    starts: NDArray[np.int64]
    stops: NDArray[np.int64]
    first: NDArray[np.int64]
    count: NDArray[np.int64]

    def place(self, number: int, rows: slice | NDArray = slice(None)) -> tuple[NDArray, NDArray]:
        """(k,) start and length of the lines' words of a number."""
        word = self.first[rows] + number
        return self.starts[word], self.stops[word] - self.starts[word]

    def character(self, number: int, at: int = 0) -> NDArray[np.uint8]:
        """(k,) a character of a word; of the text behind it where it is shorter."""
        return self.raw[np.minimum(self.starts[self.first + number] + at, len(self.raw) - 1)]


def _number(
    raw: NDArray[np.uint8], start: NDArray, length: NDArray, base: int, most: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(k,) values of words of digits, and whether each is one of 1 to `most` digits."""
    values, good = np.zeros(len(start), np.int64), (length > 0) & (length <= most)
    digits = _VALUES[base]
    for i in range(min(most, int(length.max(initial=0)))):
        inside = length > i
        digit = digits[raw[np.where(inside, start + i, start)]]
        good &= ~inside | (digit >= 0)
        values = np.where(inside, values * base + digit, values)
    return values, good


def _fill(lines: Lines, row: NDArray, raw: NDArray[np.uint8], words: _Words, base: int) -> None:
    """Read the lines `row`, which have enough words to be frames."""
    t_ns, good = _times(raw, *words.place(0))
    start, length = words.place(_CHANNEL)
    channel, fits = _number(raw, start, length, 10, 3)
    good &= fits & (channel > 0)
    start, length = words.place(_ID)
    extended = (raw[start + length - 1] | 0x20) == ord("x")
    can_id, fits = _number(raw, start, length - extended, base, 9)
    good &= fits & (can_id <= EFF_MASK)
    start, length = words.place(_DIR)
    letter = words.character(_DIR)
    good &= (length == 2) & (words.character(_DIR, 1) == ord("x")) & np.isin(letter, list(b"RT"))
    _, type_length = words.place(_TYPE)
    good &= (type_length == 1) & (words.character(_TYPE) == ord("d"))
    _, dlc_length = words.place(_DLC)
    dlc = _NIBBLE[words.character(_DLC)]
    good &= (dlc_length == 1) & (dlc >= 0)
    used = np.clip(dlc, 0, WIDTH)
    good &= words.count >= _DATA + used
    data, fits = (_octets if base == 16 else _decimal_octets)(raw, words, np.where(good, used, 0))
    good &= fits
    lines.framed[row] = good
    lines.t_ns[row], lines.channel[row] = t_ns, channel - 1
    lines.can_id[row] = can_id | np.where(extended, EFF_FLAG, 0)
    data[np.arange(WIDTH) >= used[:, None]] = 0
    lines.length[row], lines.data[row], lines.sent[row] = used, data, letter == ord("T")


def _octets(raw: NDArray[np.uint8], words: _Words, used: NDArray) -> tuple[NDArray, NDArray[np.bool_]]:
    """(k, 8) payloads of words of two hexadecimal digits, (k,) of them in use, and whether all are such."""
    place = np.minimum(words.first[:, None] + _DATA + np.arange(WIDTH), len(words.starts) - 1)
    start = words.starts[place]
    last = raw[np.minimum(start + 1, len(raw) - 1)].astype(np.uint16)
    value = _PAIR[raw[start].astype(np.uint16) << 8 | last]
    right = (value >= 0) & (words.stops[place] - start == 2)
    right |= np.arange(WIDTH) >= used[:, None]
    return value.astype(np.uint8), right.all(axis=1)


def _decimal_octets(
    raw: NDArray[np.uint8], words: _Words, used: NDArray
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """The same of words of up to three decimal digits."""
    data, good = np.zeros((len(used), WIDTH), np.uint8), np.ones(len(used), bool)
    for i in range(WIDTH):
        has = np.flatnonzero(used > i)
        value, fits = _number(raw, *words.place(_DATA + i, has), 10, 3)
        data[has, i] = value & 0xFF
        good[has] &= fits & (value < 256)
    return data, good


def _times(
    raw: NDArray[np.uint8], start: NDArray, length: NDArray
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(k,) times [ns] of words with a point or comma, and whether each is one."""
    point = np.full(len(start), -1)
    for i in range(min(12, int(length.max(initial=0)))):
        found = (point < 0) & (length > i) & np.isin(raw[np.minimum(start + i, len(raw) - 1)], list(b".,"))
        point[found] = i
    good = (point > 0) & (length - point - 1 <= _LONGEST_FRACTION)
    at = np.where(good, point, 0)
    whole, fits = _number(raw, start, at, 10, 10)
    digits = np.where(good, length - at - 1, 0)
    fraction, fine = _number(raw, start + at + 1, digits, 10, _LONGEST_FRACTION)
    scale = 10 ** np.clip(_LONGEST_FRACTION - digits, 0, 9)
    good &= fits & fine & (whole < MOST_S)
    return np.where(good, whole, 0) * 10**9 + fraction * scale, good
