"""The attitude of a craft, however its scenario states it: by a law, or as flown."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.attitude import transposed
from gnss_hil.emulator.attitude.profile import build_attitude
from gnss_hil.emulator.attitude.table import COLUMNS, AttitudeTableError, TabulatedAttitude
from gnss_hil.emulator.config import tables as scenario
from gnss_hil.emulator.config.tables import ScenarioError, Tell, untold
from gnss_hil.emulator.files import csv_table
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.orbits.motion import Motion

DOUBT_RAD = np.radians(1.0)
"""A doubt of a tabulated attitude that is told."""


class Attitude(Protocol):
    """How a craft is turned."""

    def at(self, t_ns: int, state: CraftState) -> tuple[F64, F64]:
        """Quaternion body from ECEF (4,) and rate relative to inertial space, body axes (3,) [rad/s]."""
        ...

    def over(self, t_ns: I64, state: CraftState) -> tuple[F64, F64]:
        """The same (q, 4) and (q, 3) at times (q,) with the craft's states (q, 3) there."""
        ...


def build_turning(
    name: str,
    attitude: scenario.Attitude,
    time: scenario.Time,
    motion: Motion,
    measured: Orientation | None,
    tell: Tell = untold,
) -> Attitude:
    """The attitude of a craft; ScenarioError with one line if its table does not serve."""
    if attitude.file is None or attitude.convention is None:
        return build_attitude(attitude, time.start_ns, motion.at(time.start_ns))
    try:
        rows = csv_table.read(Path(attitude.file), COLUMNS)
        table = TabulatedAttitude(rows, attitude.file, measured, attitude.convention)
        table.check(*time.span_ns, attitude.file)
    except (FileError, AttitudeTableError) as error:
        raise ScenarioError(f"craft.{name}.attitude: {error}") from None
    doubt_rad, step_s = table.doubt_rad(*time.span_ns)
    if doubt_rad > DOUBT_RAD:
        tell(
            f"craft.{name}.attitude: {attitude.file}: rows are {step_s:g} s apart, too coarse a step for how "
            f"the craft turns: between them it is uncertain by some {np.degrees(doubt_rad):.2g} deg"
        )
    looks_transposed = transposed.remark(table, motion, time.span_ns, measured)
    if looks_transposed is not None:
        tell(f"craft.{name}.attitude: {attitude.file} ({attitude.convention}): {looks_transposed}")
    return table
