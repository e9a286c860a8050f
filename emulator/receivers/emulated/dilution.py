"""Sets of satellites with a small geometric dilution of precision: what the rule `gdop` searches by.

The best six of fourteen satellites are one of 3003 sets, too many to try for every receiver. Satellites are
taken away one after another instead, each time the one without which the dilution grows least, until as many
are left as there are channels. Source: the greedy method of Walter, Blanch and Kropp, Satellite Selection
for Multi-Constellation SBAS, ION GNSS+ 2016; the growth by the matrix inversion lemma.

The dilution is that of position and clock and, where a set holds both systems, of the GLONASS offset with
them: GDOP^2 = trace (G^T G)^-1. Sets of one system, which have no offset to find, compete with mixed ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

WORTHWHILE = 0.9
"""A receiver leaves satellites it has for others only if the dilution falls below this share of what it can
have with them (modelled: a change costs an acquisition)."""

UNKNOWNS = 5
_FREE = 1e-6
"""Weight of what is known of an unknown beforehand: next to nothing, but sets of too few satellites remain
comparable. It changes a dilution of 10 by less than 1e-4 of itself."""
_PINNED = 1e12
"""The same for an offset that a set of one system does not have: it is zero."""
_LEAST = 1e-12


def smallest(los: Array, glonass: Flags, eligible: Flags, present: Flags, wanted: NDArray) -> Flags:
    """The set of each receiver, (m, n): as many satellites as it wants, or all there are.

    los       (n, 3) unit vectors to the satellites
    glonass   (n,) whether a satellite is of GLONASS
    eligible  (m, n) what a receiver may choose of
    present   (m, n) what it has of these; kept unless others are worthwhile
    wanted    (m,)
    """
    design = np.column_stack((los, np.ones(len(los)), glonass))
    systems = np.array((np.ones(len(los), bool), ~glonass, glonass))
    prior = np.full((3, UNKNOWNS), _FREE)
    prior[1:, -1] = _PINNED
    # Cases (2, 3, m): nothing kept or the present kept; both systems, GPS or GLONASS alone; receivers.
    keep = np.stack((np.zeros_like(present), present))[:, None]
    pool = eligible & systems[:, None]
    shape = 2, 3, *eligible.shape
    pool, keep = np.broadcast_to(pool, shape), np.broadcast_to(keep, shape)
    number = np.minimum(wanted, eligible.sum(axis=1))
    allowed = ~(keep & ~pool).any(axis=-1) & (pool.sum(axis=-1) >= number)
    flat = 6 * len(eligible), len(los)
    sets = thinned(
        design,
        pool.reshape(flat),
        keep.reshape(flat),
        np.tile(number, 6),
        np.tile(np.repeat(prior, len(eligible), axis=0), (2, 1)),
    ).reshape(shape)
    gdop = np.where(allowed, dilutions(design, sets, prior[:, None]), np.inf)
    receiver = np.arange(len(eligible))
    system = gdop.argmin(axis=1)
    anew, kept = np.take_along_axis(gdop, system[:, None], axis=1)[:, 0]
    how = np.where(anew < WORTHWHILE * kept, 0, 1)
    return sets[how, system[how, receiver], receiver]


def thinned(design: Array, pool: Flags, keep: Flags, wanted: NDArray, prior: Array) -> Flags:
    """Sets (b, n) left of pools (b, n) when no more than wanted (b,) may be left.

    design (n, u); keep (b, n) is not taken away; prior (b, u) weights of what is known of the unknowns.

    Without satellite g the trace of S = (G^T G)^-1 grows by |S g|^2 / (1 - g^T S g).
    """
    left, case = pool.copy(), np.arange(len(pool))
    inverse = _inverse(design, pool, prior)
    count = pool.sum(axis=1)
    for _ in range(max(0, int((count - wanted).max(initial=0)))):
        along = design @ inverse
        rest = np.maximum(1 - np.einsum("bni,ni->bn", along, design), _LEAST)
        growth = np.einsum("bni,bni->bn", along, along) / rest
        worst = np.where(left & ~keep, growth, np.inf).argmin(axis=1)
        goes = count > wanted
        left[case, worst] &= ~goes
        count -= goes
        step = along[case, worst] * (goes / np.sqrt(rest[case, worst]))[:, None]
        inverse += step[:, :, None] * step[:, None, :]
    return left


def dilutions(design: Array, sets: Flags, prior: Array) -> Array:
    """GDOP (...) of sets (..., n) of satellites with rows design (n, u); prior (..., u) as above."""
    return np.sqrt(np.trace(_inverse(design, sets, prior), axis1=-2, axis2=-1))


def _inverse(design: Array, sets: Flags, prior: Array) -> Array:
    """(..., u, u) inverse of the normal matrices, by Cholesky."""
    unknowns = np.eye(design.shape[1])
    normal = (design.T * sets[..., None, :]) @ design + prior[..., None] * unknowns
    factor = np.linalg.solve(np.linalg.cholesky(normal), unknowns)
    return np.swapaxes(factor, -1, -2) @ factor
