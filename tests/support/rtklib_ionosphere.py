"""RTKLIB's ionosphere, through the package pyrtklib."""

from __future__ import annotations

import pyrtklib


def doubles(values):
    """A C array of doubles."""
    array = pyrtklib.Arr1Ddouble(len(values))
    for k, value in enumerate(values):
        array[k] = float(value)
    return array
