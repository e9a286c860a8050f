"""The single best antenna, ASN-M practice: the antenna that sees most satellites, alone.

An antenna sees a satellite if its receiver delivers a measurement of it that may enter a fix. The rules,
which no source states:

- The leading antenna leads until another sees strictly more: there is no further hysteresis, and none less.
- Of several that see most, the lowest leads.
- An antenna that leads without a fix goes on leading: the next-best one is not asked.

The position is that of the leading antenna. Where the lead changes it jumps by the difference of the lever
arms, and the velocity by that of their rates.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.flightsw.estimation.fix_inputs import Circumstances, solve_alone
from gnss_hil.flightsw.estimation.position import Fix, NoFix
from gnss_hil.flightsw.measurement.observables import Ranges


def leader(m: Ranges, antennas: int, leading: int) -> int:
    """The antenna that leads from now on; `leading` led before, -1 none."""
    pairs = np.unique(np.array((m.receiver, m.sat)), axis=1)
    seen = np.bincount(pairs[0], minlength=antennas)
    best = int(seen.argmax())
    return best if leading < 0 or seen[best] > seen[leading] else leading


def single(m: Ranges, at: Circumstances) -> tuple[Fix | NoFix, int]:
    """The fix of the leading antenna, and which that is."""
    leading = leader(m, len(at.domain), at.leading)
    return solve_alone(m, leading, at), leading
