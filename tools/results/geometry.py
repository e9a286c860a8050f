"""Geometry of a fix, computed from what is on the bus and nothing else."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import GLONASS, NUMBERS, SATELLITES

_SINGULAR = 1e-9
"""Smallest eigenvalue of the normal equations, satellites of unit weight, below which there is no PDOP."""


def distinct_satellites(sat: NDArray[np.int64]) -> NDArray[np.int64]:
    """(e,) different satellites among sat (e, m, channels), -1 for none."""
    return (_measurements(sat) > 0).sum(axis=1)


def _measurements(sat: NDArray[np.int64]) -> NDArray[np.int64]:
    """(e, SATELLITES) how many channels measure each satellite."""
    epochs = len(sat)
    flat = sat.reshape(epochs, -1)
    row, column = np.nonzero(flat >= 0)
    count = np.bincount(row * SATELLITES + flat[row, column], minlength=epochs * SATELLITES)
    return count.reshape(epochs, SATELLITES)


def distinct_pdop(
    sat: NDArray[np.int64], position_m: NDArray, craft_m: NDArray, domain: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Position dilution of precision over distinct satellites, nan where singular.

    sat         (e, m, channels) satellite index, -1 where the channel is not in the fix
    position_m  (e, m, channels, 3) satellites, ECEF
    craft_m     (e, 3) the fix, ECEF
    domain      (e, m) clock domain of each receiver
    returns     (e,)

    A satellite measured on k channels counts once: its measurements have weight 1/k. Unknowns: position, a
    clock per domain, and an offset between systems where GLONASS is not alone.
    """
    pdop = np.full(len(sat), np.nan)
    epoch, receiver, channel = np.nonzero(sat >= 0)
    if not len(epoch):
        return pdop
    number = sat[epoch, receiver, channel]
    weight = 1.0 / _measurements(sat)[epoch, number]
    line = position_m[epoch, receiver, channel] - craft_m[epoch]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    glonass = number // NUMBERS == GLONASS
    alone = np.bincount(epoch, ~glonass, len(sat)) == 0
    domains = domain[epoch, receiver]
    design = np.column_stack([line, domains[:, None] == np.unique(domains), glonass & ~alone[epoch]])

    begin = np.flatnonzero(np.r_[True, epoch[1:] != epoch[:-1]])
    products = design[:, :, None] * (design * weight[:, None])[:, None, :]
    normal = np.add.reduceat(products, begin, axis=0)
    unknowns = np.arange(normal.shape[1])
    normal[:, unknowns, unknowns] += normal[:, unknowns, unknowns] == 0  # a clock nobody uses stays apart
    value, vector = np.linalg.eigh(normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = (vector[:, :3, :] ** 2 / value[:, None, :]).sum(axis=(1, 2))
    pdop[epoch[begin]] = np.sqrt(np.where(value[:, 0] > _SINGULAR, variance, np.nan))
    return pdop
