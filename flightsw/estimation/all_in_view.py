"""Step 10 of RU 2706636 C1: all measurements of all antennas, reduced to the centre of mass.

The reduction is that of the prototype, RU 2654321. A fix without lever arms would be metres wrong without
saying so: without attitude there is none.
"""

from __future__ import annotations

from gnss_hil.flightsw.attitude.attitude import levers_ecef
from gnss_hil.flightsw.estimation.fix_inputs import Circumstances
from gnss_hil.flightsw.estimation.position import Fix, NoFix, solve
from gnss_hil.flightsw.measurement.observables import Ranges


def together(m: Ranges, at: Circumstances) -> tuple[Fix | NoFix, int]:
    """One solution for the centre of mass; no antenna leads."""
    if at.attitude is None:
        return NoFix.NO_ATTITUDE, at.leading
    lever, lever_rate = levers_ecef(at.attitude, at.lever_arm_body_m)
    fix = solve(
        m,
        lever.T[:, m.receiver],
        lever_rate.T[:, m.receiver],
        at.domain[m.receiver],
        at.start_m,
        at.ura_scale,
        at.rules,
    )
    return fix, at.leading
