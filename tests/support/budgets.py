"""Error budgets for tests of the flight software: what ranges are taken to err by."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.vehicle import ReceiverFigures
from gnss_hil.flightsw.measurement.budget import budget_of
from gnss_hil.flightsw.measurement.options import MeasurementOptions

SPACE_M = 0.6
"""1 sigma of what satellites report, where tests state it."""


def budget(ura_scale=1.0, **figures):
    return budget_of(ReceiverFigures(**figures), MeasurementOptions(ura_scale=ura_scale))


BUDGET = budget()


def sigma_m(ranges, ura_scale=1.0):
    """(n,) 1 sigma of ranges of which no two are of one satellite."""
    return np.sqrt(ranges.code_variance_m2 + (ura_scale * ranges.space_sigma_m) ** 2)
