"""`gnss-hil emulate`: the emulator alone, the same as `python -m gnss_hil.emulator`."""

from __future__ import annotations

from gnss_hil.emulator.__main__ import add_arguments, run

__all__ = ["add_arguments", "run"]
