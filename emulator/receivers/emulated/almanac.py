"""Almanac predictions on the bus: a slice of the sky each epoch.

The unit's almanac is one. Its receivers deal the satellites out among themselves, one place further in
every pass, so that each satellite passes once a cycle and each receiver sends all of them in turn.
Predictions are those of the almanac that a scenario names; without one the truth as coarse as the message
(250 m, 1 m/s) and never old, age 0 h (modelled: a real almanac is off by kilometres, which no choice of
satellites notices). Cold receivers have it too.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.emulator.constellation.almanac.orbits import HeldAlmanac, Predictions
from gnss_hil.emulator.constellation.sky import SkyState


def contents(held: HeldAlmanac | None, sky: SkyState) -> Bool:
    """(n,) satellites of the sky that are in the unit's almanac."""
    return sky.broadcast.available if held is None else held.known


def predictions(
    held: HeldAlmanac | None, sky: SkyState, satellite, rows: I64, mark_ns: I64 | int
) -> Predictions:
    """What the unit reports of satellites `rows` (p,) of its almanac for time marks, (p,) or one.

    sky, satellite   at the latch, and what picks the satellites (p,) from its arrays
    """
    if held is not None:
        return held.at(rows, mark_ns)
    healthy = sky.broadcast.healthy[satellite]
    return Predictions(sky.pos_ecef_m[satellite], sky.vel_ecef_mps[satellite], healthy, np.zeros(len(rows)))


def portion(known: Bool, epoch: int, epochs_per_pass: int, receivers: int) -> tuple[I64, I64]:
    """Rows of the sky that are sent in this epoch, and which receiver (0-based) sends each.

    known            (n,) satellites in the almanac
    epochs_per_pass  epochs in which all n rows pass once
    """
    number, part = divmod(epoch, epochs_per_pass)
    n = len(known)
    first, end = part * n // epochs_per_pass, (part + 1) * n // epochs_per_pass
    rows = first + known[first:end].nonzero()[0]
    return rows, (rows + number) % receivers
