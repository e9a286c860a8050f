"""The ionosphere's delay of each satellite, followed from epoch to epoch.

What two carriers of a satellite say of the delay in an epoch has more than twice the noise of either code;
the delay itself changes slowly. So it is followed by a Kalman filter of two states, delay and rate, for each
satellite, all antennas together: they are metres apart. A range is then that of the first signal less the
filtered delay, and has little more noise than the first signal alone. The model is a delay whose rate walks:
a white acceleration. From 415 km at high activity the emulator's rates change by
0.022 m/s in ten seconds and 0.063 m/s in thirty (rms; 0.11 m/s themselves): 0.007 to 0.012 m/s/sqrt(s).

Source of the formulas: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation
(2001), 6.2.2: the continuous white noise acceleration model; scalar measurements
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.satellites import SATELLITES

LONGEST_NS = 60 * NS_PER_S
"""After so long without a pair a satellite's delay is begun anew."""

FIRST_RATE_MPS = 0.1
"""1 sigma of a rate of which nothing is known, from a low orbit at high activity."""

GATE = 5.0
"""Sigmas by which a measurement may miss the prediction; farther off, the delay is begun anew."""

NEVER_NS = -(1 << 62)


@dataclass(frozen=True, slots=True, eq=False)
class IonosphereDelays:
    """Of the satellites, (SATELLITES,) each.

    t_ns      when it was last measured
    delay_m   of the code of the first signal;  rate_mps of it
    variances (3, SATELLITES) of the delay, of both, of the rate
    """

    t_ns: I64
    delay_m: F64
    rate_mps: F64
    variances: F64


def nothing_known() -> IonosphereDelays:
    """Before the first pair of carriers."""
    return IonosphereDelays(
        np.full(SATELLITES, NEVER_NS), np.zeros(SATELLITES), np.zeros(SATELLITES), np.zeros((3, SATELLITES))
    )


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """Of measurements (n,).

    delay_m, rate_mps, variance_m2, rate_variance   after them
    share     what a metre of the own measurement moves the delay
    """

    delay_m: F64
    rate_mps: F64
    variance_m2: F64
    rate_variance: F64
    share: F64


def follow(
    delays: IonosphereDelays, t_ns: int, sat: I64, measured_m: F64, variance_m2: F64, walk_mps_rts: float
) -> tuple[IonosphereDelays, Followed]:
    """Delays after measurements of satellites (n,) at t_ns, of which one satellite may have several.

    walk_mps_rts  of the rate [m/s/sqrt(s)]
    """
    found, place = np.unique(sat, return_inverse=True)
    weight = np.bincount(place, 1 / variance_m2, len(found))
    z, r = np.bincount(place, measured_m / variance_m2, len(found)) / weight, 1 / weight
    dt = (t_ns - delays.t_ns[found]) / NS_PER_S
    rate, (p, pv, v) = delays.rate_mps[found], delays.variances[:, found]
    q = walk_mps_rts**2
    with np.errstate(over="ignore", invalid="ignore"):
        x = delays.delay_m[found] + rate * dt
        p = p + dt * (2 * pv + dt * v) + q * dt**3 / 3
        pv = pv + dt * v + q * dt**2 / 2
        v = v + q * dt
        missed = np.abs(z - x) > GATE * np.sqrt(p + r)
    anew = missed | ~((dt > 0) & (dt <= LONGEST_NS / NS_PER_S))
    p, gain = np.where(anew, 0.0, p), np.where(anew, 1.0, p / (p + r))
    gain_v = np.where(anew, 0.0, pv / (p + r))
    miss = np.where(anew, 0.0, z - x)
    delay, rate = np.where(anew, z, x + gain * miss), np.where(anew, 0.0, rate + gain_v * miss)
    after = np.array(
        (
            np.where(anew, r, (1 - gain) * p),
            np.where(anew, 0.0, (1 - gain) * pv),
            np.where(anew, FIRST_RATE_MPS**2, v - gain_v * pv),
        )
    )
    columns = delays.t_ns.copy(), delays.delay_m.copy(), delays.rate_mps.copy(), delays.variances.copy()
    columns[0][found], columns[1][found], columns[2][found] = t_ns, delay, rate
    columns[3][:, found] = after
    share = gain[place] * r[place] / variance_m2
    return IonosphereDelays(*columns), Followed(
        delay[place], rate[place], after[0][place], after[2][place], share
    )
