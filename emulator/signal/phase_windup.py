"""Wind-up of the carrier phase: antennas that turn about the way of the signal.

The field of a right-handed wave turns about its way once a cycle. An antenna that turns with it, right-handed
about the direction in which the wave runs, sees fewer cycles: the phase it measures, which grows with
distance, grows by a cycle a turn. A transmitting antenna that turns so takes a cycle off. Only phase and its
rate are touched.

Source: Wu, Wu, Hajj, Bertiger & Lichten, "Effects of antenna orientation on GPS carrier phase", Manuscripta
Geodaetica 18 (1993) 91. Satellites: nominal yaw steering; noon and midnight turns take no time (modelled)
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.constellation.phase_centre import axes_ecef
from gnss_hil.emulator.signal.geometry import norm

_STEP_S = 0.5
_TURN = 2 * np.pi


def satellite_axes(pos_m: F64, sun_m: F64) -> tuple[F64, F64]:
    """Unit vectors x and y (..., 3) of satellites at pos_m (..., 3), the Sun at sun_m (3,), geocentric."""
    axes = axes_ecef(pos_m, sun_m)
    return axes[..., 0, :], axes[..., 1, :]


def antenna_axes(boresight: F64) -> tuple[F64, F64]:
    """Unit vectors x and y (m, 3) that make right-handed axes with boresights (m, 3).

    x is the axis of the body that is farthest from the boresight, made square to it. Another choice changes
    phases by a constant, which an ambiguity swallows.
    """
    x: F64 = np.eye(3)[np.argmin(np.abs(boresight), axis=1)]
    x = x - np.einsum("mk,mk->m", x, boresight)[:, None] * boresight
    x /= norm(x)[:, None]
    return x, np.cross(boresight, x)


def windup(along: F64, transmit: tuple[F64, F64], receive: tuple[F64, F64]) -> F64:
    """Wind-up (...,) [cycles], -1/2 to 1/2, to be added to phases that grow with distance.

    along     (..., 3) unit vectors from satellites to antennas
    transmit  x and y of the satellites, receive of the antennas; (..., 3) each.
    """
    transmitted = _dipole(along, *transmit, -1.0)
    received = _dipole(along, *receive, 1.0)
    turned = np.einsum("...k,...k->...", along, np.cross(transmitted, received))
    return np.arctan2(turned, np.einsum("...k,...k->...", transmitted, received)) / _TURN


def _dipole(along: F64, x: F64, y: F64, sense: float) -> F64:
    """The effective dipole (..., 3) of crossed ones."""
    return x - np.einsum("...k,...k->...", along, x)[..., None] * along + sense * np.cross(along, y)


def windup_and_rate(
    pos_tx_m: F64,
    vel_tx_mps: F64,
    sun_m: F64,
    pos_rx_m: F64,
    vel_rx_mps: F64,
    receive: tuple[F64, F64],
    rate_rx_rps: F64,
) -> tuple[F64, F64]:
    """Wind-up (p,) [cycles], -1/2 to 1/2, and its rate (p,) [cycles/s] from half a second before and after.

    pos_tx_m, pos_rx_m       (p, 3) satellites and antennas, with inertial velocities, in the same axes
    sun_m                    (3,)
    receive                  x and y (p, 3) of the antennas;  rate_rx_rps (3,) at which these turn, inertial
    """
    shift = np.array((-_STEP_S, 0.0, _STEP_S))[:, None, None]
    satellite = pos_tx_m + shift * vel_tx_mps
    along = pos_rx_m + shift * vel_rx_mps - satellite
    along /= norm(along)[..., None]
    x, y = (axis + shift * np.cross(rate_rx_rps, axis) for axis in receive)
    before, now, after = windup(along, satellite_axes(satellite, sun_m), (x, y))
    return now, _wrapped(after - before) / (2 * _STEP_S)


def _wrapped(cycles: F64) -> F64:
    return cycles - np.rint(cycles)


def unwrapped(cycles: F64, before: F64) -> F64:
    """Turns (...,) counted on from those of the epoch before, nan where there were none [cycles]."""
    return cycles + np.rint(np.where(np.isnan(before), cycles, before) - cycles)
