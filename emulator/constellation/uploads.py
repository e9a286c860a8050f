"""When satellites are given new ephemerides: what they report is off by something else from then on.

Each satellite has its own moment within the period, drawn once; it is a boundary of an issue of data, so
that receivers notice. The number of an upload is all that its errors depend on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import SKY_KEY, Stream

MINUTE_NS = 60_000_000_000

ISSUE_MINUTES = {satellites.GPS: 120, satellites.GLONASS: 30}
"""How long an issue of data lasts. IS-GPS-200, 20.3.4.5, table 20-XII; GLONASS ICD 5.1 (2008), 4.4, P1."""

_AGE_MINUTES = 1 << 40


@dataclass(frozen=True, slots=True, eq=False)
class Uploads:
    """period_min, phase_min (n,): uploads are at phase + number * period, in minutes of GPS time."""

    period_min: I64
    phase_min: I64

    def number(self, minute: I64) -> I64:
        """(s, n) upload in force in each minute (s,)."""
        return (minute[:, None] - self.phase_min) // self.period_min

    def begun(self, number: I64) -> I64:
        """(s, n) minute in which uploads of these numbers came."""
        return self.phase_min + number * self.period_min


def uploads(seed: int, index: I64, period_s: dict[int, float]) -> Uploads:
    """The uploads of satellites index (n,), `gnss_hil.dbc.common.satellites`; period_s by system, whole
    minutes.

    Satellites of other systems are never given anything new: one upload serves for an age.
    """
    system = satellites.system_of(index)
    raw = Stream(seed, SKY_KEY, "uploads").words(0, satellites.SATELLITES)[index]
    period, phase = np.full(len(index), _AGE_MINUTES), np.zeros(len(index), np.int64)
    for which, seconds in period_s.items():
        of_it, minutes, issue = system == which, round(seconds / 60), ISSUE_MINUTES[which]
        period[of_it] = minutes
        phase[of_it] = np.floor(keyed_draws.uniform(raw[of_it]) * minutes / issue).astype(np.int64) * issue
    return Uploads(period, phase)


def by_number(stream: Stream, number: I64, index: I64, per_satellite: int) -> NDArray:
    """Standard normal numbers (s, n, per_satellite) of satellites index (n,) and uploads number (s, n)."""
    different, place = np.unique(number, return_inverse=True)
    count = satellites.SATELLITES * per_satellite
    raw = np.stack([stream.words(k, count) for k in different.tolist()])
    drawn = raw.reshape(len(different), satellites.SATELLITES, -1)[:, index]
    return keyed_draws.normal(drawn)[place.reshape(number.shape), np.arange(len(index))]
