"""Truth of one craft and epoch: what the run is judged by. Never on the bus."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.clocks.bounded_wander import DOMAINS

SYSTEMS = satellites.SATELLITES // satellites.NUMBERS

TRUTH = np.dtype(
    [
        ("t_gps_ns", "<i8"),  # time mark
        ("craft", "u1"),  # number of the craft in the scenario, 0-based
        ("position_ecef_m", "<f8", 3),  # centre of mass, WGS-84
        ("velocity_ecef_mps", "<f8", 3),  # relative to the Earth
        ("quaternion_body_from_ecef", "<f8", 4),  # Hamilton, scalar first, passive
        ("rate_body_rps", "<f8", 3),  # relative to inertial space
        ("clock_s", "<f8", DOMAINS),  # receiver clock minus GPS time, by clock domain
        ("in_view", "<u8", SYSTEMS),  # by system, bit `number`: healthy and strong enough at some antenna
        ("satellites_visible", "<u2"),  # how many those are
    ]
)


def in_view_bits(index) -> np.ndarray:
    """(SYSTEMS,) uint64 bit sets of satellite indices (n,)."""
    seen = np.zeros(satellites.SATELLITES, np.uint8)
    seen[index] = 1
    return np.packbits(seen, bitorder="little").view("<u8")
