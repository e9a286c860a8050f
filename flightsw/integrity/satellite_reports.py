"""Are satellites where they were? What they report of themselves is compared with what they reported before.

A satellite moves 3.9 km in a second: frames of another time show by where they say that it is, whoever sends
them and whatever protects them. What a fix has proven is believed rather than what contradicts it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.orbit.almanac import Predictions
from gnss_hil.flightsw.records.epoch import AlmanacRows, Epoch
from gnss_hil.flightsw.records.solution import OrbitState

TO_TELL = 4
"""So many satellites must be known before they tell what time it is."""


@dataclass(frozen=True, slots=True, eq=False)
class Reports:
    """Of an epoch, judged; (n,) by its measurements.

    sent_ns    when their signals were transmitted
    in_orbit   they are in an orbit
    moved      they were proven to be somewhere else;  compared: so much is known of them
    almanac    the almanac frames that describe an orbit
    """

    sent_ns: I64
    in_orbit: Bool
    moved: Bool
    compared: Bool
    almanac: AlmanacRows

    @property
    def sound(self) -> Bool:
        return self.in_orbit & ~self.moved

    @property
    def agree(self) -> bool:
        """Whether satellites enough to tell, and most of them, are where they must be at this time."""
        known = int(np.count_nonzero(self.compared))
        return known >= TO_TELL and 2 * int(np.count_nonzero(self.compared & self.sound)) > known


def judged(predictions: Predictions, epoch: Epoch, orbit: OrbitState | None) -> Reports:
    """Of an epoch's measurements and almanac, by the predictions before it, and where the craft was."""
    m, t_ns = epoch.measurements, 0 if epoch.mark is None else epoch.mark.t_ns
    rows, in_orbit = almanac.orbits(epoch.almanac, m)
    sent_ns = t_ns - almanac.flight_ns(m, None if orbit is None else orbit.position_m)
    moved, compared = almanac.contradicted(predictions, m, sent_ns, t_ns)
    return Reports(sent_ns, in_orbit, moved, compared, rows)
