"""Channels into ranges: one range for each antenna and satellite, whatever channels it came on.

A receiver may deliver several signals of one satellite. Counted apart they would make two witnesses of one:
the same satellite's errors, the same ray, the same ionosphere but for a factor. So one of them stands for all
(`of_one_signal`), or two become one range without ionosphere
(`gnss_hil.flightsw.measurement.ionosphere_free`).
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.flightsw.measurement.budget import Budget
from gnss_hil.flightsw.measurement.signals import RANK, electrons
from gnss_hil.flightsw.measurement.space import space_sigma
from gnss_hil.flightsw.records.epoch import Measurements
from gnss_hil.flightsw.records.ranges import Ranges, distinct


def antenna_satellite(m: Measurements) -> I64:
    """(n,) one number for each antenna and satellite."""
    return m.receiver * SATELLITES + m.sat


def of_each_channel(m: Measurements, budget: Budget) -> Ranges:
    """Every channel a range."""
    cn0_hz = 10 ** (0.1 * m.cn0_dbhz)
    space_m, bias_m, space_mps = space_sigma(m.ura, m.sat, m.signal)
    rate = budget.noise.rate_variance_m2ps2(cn0_hz, m.signal, m.frequency)
    return Ranges(
        receiver=m.receiver,
        sat=m.sat,
        channels=np.left_shift(1, m.channel),
        pseudorange_m=m.pseudorange_m,
        range_rate_mps=m.range_rate_mps,
        pos_sv_m=m.pos_sv_m,
        vel_sv_mps=m.vel_sv_mps,
        clock_m=m.clock_m,
        clock_drift_mps=m.clock_drift_mps,
        code_variance_m2=budget.noise.code_variance_m2(cn0_hz, m.signal),
        rate_variance_m2ps2=rate,
        sat_rate_sigma_mps=budget.ura_scale * space_mps,
        space_sigma_m=space_m,
        code_bias_sigma_m=bias_m,
        followed_sigma_m=np.zeros(len(m)),
        electrons=electrons(m.signal, m.frequency),
    )


def of_one_signal(m: Measurements, budget: Budget) -> Ranges:
    """Of several channels with one satellite on one antenna the one with the signal of first choice.

    Of equals it is the lowest channel.
    """
    pair = antenna_satellite(m)
    if distinct(pair) < len(pair):
        order = np.lexsort((m.channel, RANK[m.signal], pair))
        first = np.diff(pair[order], prepend=-1) != 0
        m = m[np.sort(order[first])]
    return of_each_channel(m, budget)
