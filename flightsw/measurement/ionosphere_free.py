"""Two signals of a satellite on two carriers as one range that the ionosphere does not delay.

To first order the delay of a code, and the advance of a carrier, goes by the square of the wavelength:
P1 = P + I, P2 = P + g I with g = (f1 / f2)^2. Hence P = (g P1 - P2) / (g - 1). What adds to a pseudorange
goes by the same coefficients: the satellite's clock with the group delay of each signal, and, the signals
having left a tenth of a microsecond apart, its place at transmission. So do range rates, which are those of
carriers. The price is noise: for GPS L1 and L2, 2.546^2 and 1.546^2 of the two variances, 2.98 times the
deviation where both are alike.
Source: IS-GPS-200, 20.3.3.3.3.3
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Index
from gnss_hil.flightsw.measurement.budget import Budget
from gnss_hil.flightsw.measurement.ionosphere_filter import IonosphereDelays, follow
from gnss_hil.flightsw.measurement.observables import antenna_satellite, of_each_channel
from gnss_hil.flightsw.measurement.signals import PAIRS, carrier_hz
from gnss_hil.flightsw.records.epoch import Measurements
from gnss_hil.flightsw.records.ranges import Ranges


def ionosphere_free(m: Measurements, budget: Budget) -> Ranges:
    """A range of every antenna and satellite that delivers a pair of signals; the others are left out."""
    first, second = paired(m)
    hz = carrier_hz(m.signal, m.frequency)
    share = hz[first] ** 2 / (hz[first] ** 2 - hz[second] ** 2)
    whole = of_each_channel(m, budget)
    a, b = whole[first], whole[second]

    def of(name: str) -> F64:
        return share * getattr(a, name) + (1 - share) * getattr(b, name)

    def noise_of(name: str) -> F64:
        return share**2 * getattr(a, name) + (1 - share) ** 2 * getattr(b, name)

    return Ranges(
        receiver=a.receiver,
        sat=a.sat,
        channels=a.channels | b.channels,
        pseudorange_m=of("pseudorange_m"),
        range_rate_mps=of("range_rate_mps"),
        pos_sv_m=of("pos_sv_m"),
        vel_sv_mps=of("vel_sv_mps"),
        clock_m=of("clock_m"),
        clock_drift_mps=of("clock_drift_mps"),
        code_variance_m2=noise_of("code_variance_m2"),
        rate_variance_m2ps2=noise_of("rate_variance_m2ps2"),
        sat_rate_sigma_mps=np.maximum(a.sat_rate_sigma_mps, b.sat_rate_sigma_mps),
        space_sigma_m=np.maximum(a.space_sigma_m, b.space_sigma_m),
        code_bias_sigma_m=np.hypot(share * a.code_bias_sigma_m, (1 - share) * b.code_bias_sigma_m),
        followed_sigma_m=np.zeros(len(a)),
        electrons=np.zeros(len(a)),
    )


def filtered(
    m: Measurements, budget: Budget, delays: IonosphereDelays, t_ns: int, walk_mps_rts: float
) -> tuple[IonosphereDelays, Ranges]:
    """The same ranges with less noise: of the first signal, less the delay that has been followed from epoch
    to epoch (`gnss_hil.flightsw.measurement.ionosphere_filter`); and the delays after this one.

    A delay is (P2 - P1) / (g - 1), each with its own clock added. Errors of P1 are in both the range and, by
    its share, the delay; variances say so. Without a past it is the combination of one epoch.

    The delay, of variance V, is in the ranges of all antennas that have the satellite. With the error of P1
    in range i, of variance v_i, it covaries by -c_i, hence two ranges by V + c_i + c_j. A column of
    sqrt(V) + c_i / sqrt(V) has that and c_i c_j / V, a few per cent, too much; what each has for itself is
    v_i - c_i^2 / V, so that variances are exact.
    """
    first, second = paired(m)
    hz = carrier_hz(m.signal, m.frequency)
    per_metre = 1 / (hz[first] ** 2 / hz[second] ** 2 - 1)
    whole = of_each_channel(m, budget)
    a, b = whole[first], whole[second]
    measured_m = per_metre * (b.pseudorange_m + b.clock_m - a.pseudorange_m - a.clock_m)
    variance_m2 = per_metre**2 * (a.code_variance_m2 + b.code_variance_m2)
    delays, followed = follow(delays, t_ns, a.sat, measured_m, variance_m2, walk_mps_rts)
    delay_m = np.sqrt(followed.variance_m2)
    covariant_m = followed.share * per_metre * a.code_variance_m2 / delay_m
    return delays, Ranges(
        receiver=a.receiver,
        sat=a.sat,
        channels=a.channels | b.channels,
        pseudorange_m=a.pseudorange_m - followed.delay_m,
        range_rate_mps=a.range_rate_mps + followed.rate_mps,
        pos_sv_m=a.pos_sv_m,
        vel_sv_mps=a.vel_sv_mps,
        clock_m=a.clock_m,
        clock_drift_mps=a.clock_drift_mps,
        code_variance_m2=a.code_variance_m2 - covariant_m**2,
        rate_variance_m2ps2=a.rate_variance_m2ps2,
        sat_rate_sigma_mps=np.hypot(a.sat_rate_sigma_mps, np.sqrt(followed.rate_variance)),
        space_sigma_m=np.maximum(a.space_sigma_m, b.space_sigma_m),
        # What lasts, no filter takes away.
        code_bias_sigma_m=np.hypot((1 + per_metre) * a.code_bias_sigma_m, per_metre * b.code_bias_sigma_m),
        followed_sigma_m=delay_m + covariant_m,
        electrons=np.zeros(len(a)),
    )


def paired(m: Measurements) -> tuple[Index, Index]:
    """Rows (k,) of first and of second signals, in the order of the first; for each antenna and satellite the
    pair that `PAIRS` has first."""
    pair, offered = antenna_satellite(m), set(m.signal.tolist())
    done = np.zeros(0, np.int64)
    first, second = [done], [done]
    for one, other in PAIRS:
        if one not in offered or other not in offered:
            continue
        rows, others = np.flatnonzero(m.signal == one), np.flatnonzero(m.signal == other)
        both, i, k = np.intersect1d(pair[rows], pair[others], return_indices=True)
        new = ~np.isin(both, done)
        first.append(rows[i[new]])
        second.append(others[k[new]])
        done = np.concatenate((done, both[new]))
    rows, others = np.concatenate(first), np.concatenate(second)
    order = np.argsort(rows)
    return rows[order], others[order]
