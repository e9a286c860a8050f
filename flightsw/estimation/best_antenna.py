"""The single best antenna, ASN-M practice: the antenna that sees most satellites, alone.

An antenna sees a satellite if its receiver delivers a measurement of it that may enter a fix. The rules,
which no source states:

- The selected antenna stays until another sees strictly more: there is no further hysteresis, and none less.
- Of several that see most, the lowest is selected.
- A selected antenna without a fix stays selected: the next-best one is not asked.

The position is that of the selected antenna. Where the selection changes it jumps by the difference of the
lever arms, and the velocity by that of their rates. The covariance is that of the centre of mass and has the
lever arm in it (`estimation.unreduced`).
"""

from __future__ import annotations

import numpy as np

from gnss_hil.flightsw.estimation.antenna_alone import antenna_alone
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.snapshot import Snapshot
from gnss_hil.flightsw.estimation.unreduced import for_centre_of_mass
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import Fix, NoFix


def selected_antenna(m: Ranges, antennas: int, before: int) -> int:
    """The antenna selected from now on; `before` was, -1 none."""
    pairs = np.unique(np.array((m.receiver, m.sat)), axis=1)
    seen = np.bincount(pairs[0], minlength=antennas)
    best = int(seen.argmax())
    return best if before < 0 or seen[best] > seen[before] else before


def best_antenna(m: Ranges, inputs: FixInputs, prior: Snapshot) -> tuple[Fix | NoFix, int]:
    """The fix of the selected antenna, and which that is."""
    antenna = selected_antenna(m, len(inputs.domain), prior.antenna)
    fix = antenna_alone(m, antenna, inputs, prior.start_m)
    if isinstance(fix, NoFix):
        return fix, antenna
    return for_centre_of_mass(fix, inputs.lever_arm_body_m[antenna], inputs.attitude), antenna
