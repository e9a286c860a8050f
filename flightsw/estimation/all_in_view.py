"""Step 10 of RU 2706636 C1: all measurements of all antennas, reduced to the centre of mass.

The reduction is that of the prototype, RU 2654321. A fix without lever arms would be metres wrong without
notice: without attitude there is none.
"""

from __future__ import annotations

from gnss_hil.flightsw.attitude.attitude import levers_ecef
from gnss_hil.flightsw.estimation import receiver_delays
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.position import Held, solve
from gnss_hil.flightsw.estimation.prior import prior_of
from gnss_hil.flightsw.estimation.snapshot import Snapshot
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import Fix, NoFix


def all_in_view(m: Ranges, inputs: FixInputs, prior: Snapshot) -> tuple[Fix | NoFix, int]:
    """One solution for the centre of mass; no antenna is selected."""
    if inputs.attitude is None:
        return NoFix.NO_ATTITUDE, prior.antenna
    delays = prior.delays
    if delays is None and inputs.budget.delay_m:
        delays = receiver_delays.unknown(len(inputs.domain), inputs.budget.delay_m)
    lever, lever_rate = levers_ecef(inputs.attitude, inputs.lever_arm_body_m)
    attitude = inputs.attitude
    held = Held(attitude.sigma_rad, attitude.rate_sigma_rps) if attitude.age else None
    fix = solve(
        m,
        lever.T.take(m.receiver, axis=1),
        lever_rate.T.take(m.receiver, axis=1),
        inputs.domain[m.receiver],
        prior.start_m,
        inputs.budget,
        inputs.ionosphere,
        inputs.rules,
        delays,
        prior.unlearnt_s,
        prior_of(prior.orbit) if inputs.mark_clock == 0 else None,
        held,
    )
    return fix, prior.antenna
