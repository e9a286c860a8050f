"""Shadowing: rays from antennas against the craft's own boxes and panels.

A ray is in the light or in the shadow: nothing is bent around edges. Diffraction would soften the edge of
a shadow over the first Fresnel zone, 1.4 m wide ten metres from the edge (modelled).
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.emulator.signal.structure.bodies import Bodies

START_M = 1e-6
"""Ends of a ray this short hit nothing: reflections start and end on faces."""

_PARALLEL = 1e-12


def hits(bodies: Bodies, origin_m: F64, direction: F64, length_m: F64 | float = np.inf) -> Bool:
    """Which bodies rays hit.

    origin_m    (..., 3);  direction (..., 3) unit vectors;  length_m (...); broadcast against each other
    returns     (..., b)
    Slab method: a ray is inside a body where it is between all three pairs of planes.
    Source: Kay & Kajiya, "Ray Tracing C128 Scenes", Computer Graphics 20 (1986) 269, section 2
    """
    enters: F64 | float = -np.inf
    leaves: F64 | float = np.inf
    for axis in range(3):
        along = bodies.axes[:, axis]
        speed = direction @ along.T
        speed = np.where(np.abs(speed) < _PARALLEL, _PARALLEL, speed)
        middle = ((bodies.centre_m * along).sum(axis=1) - origin_m @ along.T) / speed
        reach = bodies.half_m[:, axis] / np.abs(speed)
        enters = np.maximum(enters, middle - reach)
        leaves = np.minimum(leaves, middle + reach)
    ends = np.asarray(length_m)[..., None] - START_M
    return (enters <= leaves) & (leaves > START_M) & (enters < ends)


def blocked(bodies: Bodies, antenna_body_m: F64, los_body: F64) -> Bool:
    """(m, n) whether the structure hides a satellite from an antenna.

    antenna_body_m   (m, 3) places of the antennas, body axes, outside all boxes
    los_body         (n, 3) unit vectors to the satellites, body axes
    """
    return np.logical_or.reduce(hits(bodies, antenna_body_m[:, None], los_body[None]), axis=-1)
