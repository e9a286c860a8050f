"""Shadowing: rays from antennas against the craft's own boxes and panels.

A ray is in the light or in the shadow: nothing is bent around edges. Diffraction would soften the edge of
a shadow over the first Fresnel zone, 1.4 m wide ten metres from the edge (modelled).
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.signal.structure.bodies import Bodies

START_M = 1e-6
"""Ends of a ray this short hit nothing: reflections start and end on faces."""

_PARALLEL = 1e-12


RAYS = 4096
"""How many rays are looked at together, each with bodies of its own: some ten megabytes."""


def hits(bodies: Bodies, origin_m: F64, direction: F64, length_m: F64 | float = np.inf) -> Bool:
    """Which bodies rays hit.

    bodies      of one instant, the same for all rays; or of r, each ray's own
    origin_m    (..., 3);  direction (..., 3) unit vectors;  length_m (...); broadcast against each other, or
                (r,) where each ray has its own bodies
    returns     (..., b)
    Slab method: a ray is inside a body where it is between all three pairs of planes.
    Source: Kay & Kajiya, "Ray Tracing Complex Scenes", Computer Graphics 20 (1986) 269, section 2
    """
    enters: F64 | float = -np.inf
    leaves: F64 | float = np.inf
    for axis in range(3):
        along = bodies.axes[..., axis, :]
        speed = _onto(along, direction)
        speed = np.where(np.abs(speed) < _PARALLEL, _PARALLEL, speed)
        middle = ((bodies.centre_m * along).sum(axis=-1) - _onto(along, origin_m)) / speed
        reach = bodies.half_m[:, axis] / np.abs(speed)
        enters = np.maximum(enters, middle - reach)
        leaves = np.minimum(leaves, middle + reach)
    ends = np.asarray(length_m)[..., None] - START_M
    return (enters <= leaves) & (leaves > START_M) & (enters < ends)


def _onto(along: F64, rays: F64) -> F64:
    """Components (..., b) of vectors (..., 3) along unit vectors (b, 3), or (r, b, 3) of their own."""
    return rays @ along.T if along.ndim == 2 else np.einsum("rbj,rj->rb", along, rays)


def blocked(bodies: Bodies, antenna_body_m: F64, los_body: F64) -> Bool:
    """(m, n) whether the structure hides a satellite from an antenna.

    antenna_body_m   (m, 3) places of the antennas, body axes, outside all boxes
    los_body         (n, 3) unit vectors to the satellites, body axes
    """
    return np.logical_or.reduce(hits(bodies, antenna_body_m[:, None], los_body[None]), axis=-1)


def stopped(
    bodies: Bodies, instant: I64 | None, origin_m: F64, direction: F64, length_m: F64 | None = None
) -> Bool:
    """(r,) whether any body stands in a ray's way.

    instant   (r,) at which each ray meets the bodies of several instants; None: bodies of one instant
    origin_m, direction (r, 3);  length_m (r,), None: without end
    """
    if instant is None:
        blocks = hits(bodies, origin_m, direction, np.inf if length_m is None else length_m)
        return np.logical_or.reduce(blocks, axis=-1)
    out = np.empty(len(direction), bool)
    for first in range(0, len(direction), RAYS):
        rays = slice(first, first + RAYS)
        length = np.inf if length_m is None else length_m[rays]
        out[rays] = hits(bodies.at(instant[rays]), origin_m[rays], direction[rays], length).any(axis=-1)
    return out
