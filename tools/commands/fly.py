"""`gnss-hil fly`: the flight software alone, the same as `python -m gnss_hil.flightsw`."""

from __future__ import annotations

from gnss_hil.flightsw.__main__ import add_arguments, run

__all__ = ["add_arguments", "run"]
