"""Sets of satellites with a small geometric dilution of precision: what the rule `gdop` searches by.

The best six of fourteen satellites are one of 3003 sets, too many to try for every receiver. Satellites are
taken away one after another instead, each time the one without which the dilution grows least, until as many
are left as there are channels. Source: the greedy method of Walter, Blanch and Kropp, Satellite Selection
for Multi-Constellation SBAS, ION GNSS+ 2016; the growth by the matrix inversion lemma.

The dilution is that of position and clock and, where a set holds several systems, of their offsets with them:
GDOP^2 = trace (G^T G)^-1. Sets of fewer systems, which have fewer offsets to find, compete with mixed ones.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64, I64, Bool

WORTHWHILE = 0.9
"""A receiver leaves satellites it has for others only if the dilution falls below this share of what it can
have with them (modelled: a change costs an acquisition)."""

UNKNOWNS = 4
"""Of a set of one system: position and clock. Each further system has an offset."""

_FREE = 1e-6
"""Weight of what is known of an unknown beforehand: next to nothing, but sets of too few satellites remain
comparable. It changes a dilution of 10 by less than 1e-4 of itself."""
_PINNED = 1e12
"""The same for an offset that a set of one system does not have: it is zero."""
_LEAST = 1e-12


def smallest(los: F64, system: I64, eligible: Bool, present: Bool, wanted: I64) -> Bool:
    """The set of each receiver, (m, n): as many satellites as it wants, or all there are.

    los       (n, 3) unit vectors to the satellites
    system    (n,) of the satellites, by its value on the bus
    eligible  (m, n) what a receiver may choose of
    present   (m, n) what it has of these; kept unless others are worthwhile
    wanted    (m,)
    """
    if not len(los):
        return np.zeros_like(eligible)
    known = np.unique(system)
    of = system[:, None] == known  # (n, s)
    design = np.column_stack((los, np.ones(len(los)), of[:, 1:]))
    mixtures = _mixtures(len(known))
    cases = len(mixtures)
    prior = np.full((cases, design.shape[1]), _FREE)
    prior[:, UNKNOWNS:] = np.where(_with_offset(mixtures)[:, 1:], _FREE, _PINNED)
    # Cases (2, c, m): nothing kept or the present kept; mixtures of systems; receivers.
    keep = np.stack((np.zeros_like(present), present))[:, None]
    pool = eligible & (mixtures @ of.T)[:, None]
    shape = 2, cases, *eligible.shape
    pool, keep = np.broadcast_to(pool, shape), np.broadcast_to(keep, shape)
    number = np.minimum(wanted, eligible.sum(axis=1))
    allowed = ~(keep & ~pool).any(axis=-1) & (pool.sum(axis=-1) >= number)
    flat = 2 * cases * len(eligible), len(los)
    sets = thinned(
        design,
        pool.reshape(flat),
        keep.reshape(flat),
        np.tile(number, 2 * cases),
        np.tile(np.repeat(prior, len(eligible), axis=0), (2, 1)),
    ).reshape(shape)
    gdop = np.where(allowed, dilutions(design, sets, prior[:, None]), np.inf)
    receiver = np.arange(len(eligible))
    mixture = gdop.argmin(axis=1)
    anew, kept = np.take_along_axis(gdop, mixture[:, None], axis=1)[:, 0]
    how = np.where(anew < WORTHWHILE * kept, 0, 1)
    return sets[how, mixture[how, receiver], receiver]


def _mixtures(count: int) -> Bool:
    """(c, count) which of the systems each mixture holds: every one that is not empty, the widest first."""
    held = [set(some) for size in range(count, 0, -1) for some in combinations(range(count), size)]
    return np.array([[k in some for k in range(count)] for some in held], bool).reshape(-1, count)


def _with_offset(mixtures: Bool) -> Bool:
    """(c, s) systems whose offset a mixture has to find: all but the first, whose time the clock has."""
    first = np.argmax(mixtures, axis=1)
    return mixtures & (np.arange(mixtures.shape[1]) != first[:, None])


def thinned(design: F64, pool: Bool, keep: Bool, wanted: NDArray, prior: F64) -> Bool:
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


def dilutions(design: F64, sets: Bool, prior: F64) -> F64:
    """GDOP (...) of sets (..., n) of satellites with rows design (n, u); prior (..., u) as above."""
    return np.sqrt(np.trace(_inverse(design, sets, prior), axis1=-2, axis2=-1))


def _inverse(design: F64, sets: Bool, prior: F64) -> F64:
    """(..., u, u) inverse of the normal matrices, by Cholesky."""
    unknowns = np.eye(design.shape[1])
    normal = (design.T * sets[..., None, :]) @ design + prior[..., None] * unknowns
    factor = np.linalg.solve(np.linalg.cholesky(normal), unknowns)
    return np.swapaxes(factor, -1, -2) @ factor
