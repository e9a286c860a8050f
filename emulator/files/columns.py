"""Fixed columns of many lines at once: what Fortran wrote, read as arrays.

A file of observations holds a million numbers; cut out line by line they take seconds, gathered by column
they take tenths.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, U8, Bool

_BLANK, _PLUS, _MINUS, _POINT, _ZERO = (ord(sign) for sign in " +-.0")


class Lines:
    """The lines of a text, without their ends.

    text    one string a line
    origin  the file's name, for errors
    """

    def __init__(self, text: str, origin: str):
        self.origin = origin
        self.text = [line.rstrip("\r") for line in text.split("\n")]
        if not self.text[-1]:
            self.text.pop()
        # One byte a character: letters beyond ASCII are in names and comments only.
        self._bytes = np.frombuffer(("\n".join(self.text) + "\n").encode("ascii", "replace"), np.uint8)
        self._ends = np.flatnonzero(self._bytes == ord("\n"))
        self._starts = np.append(0, self._ends[:-1] + 1)

    def field(self, rows: I64, column: int, width: int) -> U8:
        """(k, width) characters of lines `rows` from a column on; blanks beyond a line's end."""
        place = self._starts[rows][:, None] + np.arange(column, column + width)
        inside = place < self._ends[rows][:, None]
        return np.where(inside, self._bytes[np.where(inside, place, 0)], _BLANK)


def decimals(chars: U8, places: int) -> tuple[F64, Bool]:
    """Numbers of the form Fw.d.

    chars    (k, w) characters
    places   d, digits behind the point
    returns  (k,) values, nan where blank; (k,) whether a field is neither a number of that form nor blank
    """
    width = chars.shape[1]
    point = width - 1 - places
    digits = chars - np.uint8(_ZERO)
    is_digit = digits < 10
    # Left of the point: blanks, at most one sign, digits, in this order.
    signs = (chars == _PLUS) | (chars == _MINUS)
    kind = np.where(is_digit, 2, np.where(signs, 1, np.where(chars == _BLANK, 0, 3)))[:, :point]
    good = (chars[:, point] == _POINT) & is_digit[:, point + 1 :].all(axis=1)
    good &= (kind < 3).all(axis=1) & (np.diff(kind, axis=1) >= 0).all(axis=1) & (signs.sum(axis=1) <= 1)
    blank = (chars == _BLANK).all(axis=1)
    powers = 10.0 ** np.append(
        np.arange(width - 2, places - 1, -1), np.append(0, np.arange(places - 1, -1, -1))
    )
    # Whole numbers below 2^53: the sum is exact, and the quotient the nearest number to what is written.
    values = np.where(is_digit, digits, 0) @ powers / 10.0**places
    values = np.where((chars == _MINUS).any(axis=1), -values, values)
    return np.where(good, values, np.nan), ~good & ~blank


def flags(chars: U8) -> tuple[I64, Bool]:
    """Single digits (k, 1): (k,) values, 0 where blank; (k,) whether a field is neither a digit nor blank."""
    digits = chars[:, 0] - np.uint8(_ZERO)
    return np.where(digits < 10, digits, 0).astype(np.int64), (digits >= 10) & (chars[:, 0] != _BLANK)


def nothing_but_nines(values: F64, digits: range, places: int) -> Bool:
    """Whether values, as written with some places, have so many digits before the point, all of them nines,
    and nines or noughts behind it: some programs write so that there is no value."""
    written = np.array([10.0**whole - 10.0**-part for whole in digits for part in range(places + 1)])
    return np.isin(np.round(np.abs(values), places), np.round(written, places))
