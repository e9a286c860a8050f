"""`gnss-hil fly`: the flight software alone, the same as `python -m flightsw`."""

from __future__ import annotations

from flightsw.__main__ import add_arguments, run

__all__ = ["add_arguments", "run"]
