"""Geometry of a fix, computed from what is on the bus and nothing else."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.common.satellites import NUMBERS, SATELLITES

_SINGULAR = 1e-9
"""Smallest eigenvalue of the normal equations, satellites of unit weight, below which there is no PDOP."""
_DOMAINS = _SYSTEMS = 8
"""Clock domains and satellite systems that the contract's signals can name."""


def distinct_satellites(epoch: I64, sat: I64, epochs: int) -> I64:
    """(epochs,) different satellites among measurements (k,) of an epoch each."""
    return np.bincount(np.unique(epoch * SATELLITES + sat) // SATELLITES, minlength=epochs)


def paired_satellites(epoch: I64, receiver: I64, sat: I64, carrier_hz: F64, epochs: int) -> I64:
    """(epochs,) different satellites that some receiver (0-based) has on two carriers, among measurements
    (k,) of an epoch each; carrier_hz (k,) of frequency number 0."""
    pair = (epoch * MAX_RECEIVERS + receiver) * SATELLITES + sat
    of_each = np.unique(np.stack((pair, carrier_hz.astype(np.int64))), axis=1)[0]
    found, carriers = np.unique(of_each, return_counts=True)
    two = found[carriers > 1]
    return distinct_satellites(two // (MAX_RECEIVERS * SATELLITES), two % SATELLITES, epochs)


def _rank(epoch: I64, item: I64, shape: tuple[int, int]) -> tuple[I64, I64]:
    """(k,) place of a measurement's item among the items of its epoch, and (epochs,) how many these are."""
    present = np.zeros(shape, np.int64)
    present[epoch, item] = 1
    place = np.cumsum(present, axis=1) - 1
    return place[epoch, item], place[:, -1] + 1


def distinct_pdop(
    epoch: I64,
    sat: I64,
    domain: I64,
    los_m: F64,
    epochs: int,
) -> F64:
    """Position dilution of precision over distinct satellites, nan where singular.

    epoch    (k,) ascending row of the epoch of each measurement in the fix
    sat      (k,) satellite index;  domain (k,) clock domain of the receiver
    los_m    (k, 3) from the fix to the satellite, ECEF, of any length
    returns  (epochs,)

    A satellite measured on k channels counts once: its measurements have weight 1/k. Unknowns: position, a
    clock per domain, and an offset of every system but the epoch's first.
    """
    pdop = np.full(epochs, np.nan)
    if not len(epoch):
        return pdop
    measured = np.bincount(epoch * SATELLITES + sat, minlength=epochs * SATELLITES)
    weight = 1.0 / measured[epoch * SATELLITES + sat]
    clock, clocks = _rank(epoch, domain, (epochs, _DOMAINS))
    offset, systems = _rank(epoch, sat // NUMBERS, (epochs, _SYSTEMS))
    unknowns = 3 + clocks + systems - 1
    rows = np.arange(len(epoch))
    design = np.zeros((len(epoch), int(unknowns.max())))
    design[:, :3] = los_m / np.linalg.norm(los_m, axis=1, keepdims=True)
    design[rows, 3 + clock] = 1
    later = offset > 0
    design[rows[later], (2 + clocks[epoch] + offset)[later]] = 1

    begin = np.flatnonzero(np.r_[True, epoch[1:] != epoch[:-1]])
    products = design[:, :, None] * (design * weight[:, None])[:, None, :]
    normal = np.add.reduceat(products, begin, axis=0)
    here = epoch[begin]
    for size in np.unique(unknowns[here]).tolist():  # each epoch alone, whatever is in its block
        same = np.flatnonzero(unknowns[here] == size)
        value, vector = np.linalg.eigh(normal[same, :size, :size])
        with np.errstate(divide="ignore", invalid="ignore"):
            variance = (vector[:, :3, :] ** 2 / value[:, None, :]).sum(axis=(1, 2))
            pdop[here[same]] = np.sqrt(np.where(value[:, 0] > _SINGULAR, variance, np.nan))
    return pdop
