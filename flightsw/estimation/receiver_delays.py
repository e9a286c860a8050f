"""Delays of receivers with their lines, learnt from epoch to epoch.

Receivers on one clock differ by what their lines and filters delay, metres that nobody has calibrated. In an
epoch's solution each is an unknown of a known size, which costs as much as a clock of its own. But delays
last: what one epoch tells of them serves the next, and after some minutes the receivers are as good as one.

What else errs in the ranges lasts too: satellites' own errors, the ionosphere. A hundred epochs of the same
satellites do not tell a hundred times as much. So an epoch counts by the share of `LASTING_S` that it is.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.flightsw.records.solution import ReceiverDelays

LASTING_S = 60.0
"""So long, in effect, the errors of ranges are the same. Chosen by simulation: shorter, and with every factor
on the covariance promises too much; longer, and receivers that have no delays gain nothing for minutes."""

EVERY_S = 10.0
"""So often is learnt: epochs in between tell next to nothing new."""

LEAST = 1e-9
"""Share of a variance that is left at least. Where delays may be far larger than ranges err by, rounding
makes less than nothing of it."""

DRIFT_M2PS = 0.1**2 / 3600
"""Delays walk a decimetre in an hour, by temperature (modelled)."""


def unknown(receivers: int, delay_m: float) -> ReceiverDelays:
    """Before anything is learnt: 1 sigma of each."""
    root_m: F64 = np.diag(np.full(receivers, delay_m))
    return ReceiverDelays(np.zeros(receivers), root_m)


def forgotten(delays: ReceiverDelays, which: Bool, delay_m: float) -> ReceiverDelays:
    """Without what was known of some receivers, (m,): late by something else since they were restarted."""
    covariance = delays.root_m @ delays.root_m.T
    covariance[which] = covariance[:, which] = 0.0
    covariance[which, which] = delay_m**2
    root_m: F64 = np.linalg.cholesky(covariance).astype(np.float64, copy=False)
    return ReceiverDelays(np.where(which, 0.0, delays.mean_m), root_m)


def walked(delays: ReceiverDelays, dt_s: float) -> ReceiverDelays:
    """After a time without measurements."""
    covariance = delays.root_m @ delays.root_m.T
    covariance[np.diag_indices(len(covariance))] += DRIFT_M2PS * dt_s
    root_m: F64 = np.linalg.cholesky(covariance).astype(np.float64, copy=False)
    return ReceiverDelays(delays.mean_m, root_m)


def learnt(
    delays: ReceiverDelays,
    receiver: I64,
    design: F64,
    residual_m: F64,
    weight: F64,
    covariance: F64,
    dt_s: float,
) -> ReceiverDelays:
    """After a solution by these delays.

    receiver (n,), design (n, u), residual_m (n,)   of the ranges in it, less their receivers' mean delays
    weight (n, n)       inverse of their covariance, delays inside
    covariance (u, u)   of the unknowns
    dt_s                since the epoch before
    """
    share = min(dt_s / LASTING_S, 1.0)
    columns = delays.root_m[receiver]
    pull = columns.T @ weight
    along = pull @ design
    unit = np.eye(len(delays.mean_m))
    # In units of what was known before: told at once they would be at `told`, with covariance `left`.
    told = pull @ residual_m
    left = unit - pull @ columns + along @ covariance @ along.T
    variance, axes = np.linalg.eigh(left)
    variance = np.clip(variance, LEAST, 1.0)
    after = variance / (variance + share * (1 - variance))
    step = axes @ (after * share / variance * (axes.T @ told))
    return ReceiverDelays(delays.mean_m + delays.root_m @ step, delays.root_m @ (axes * np.sqrt(after)))
