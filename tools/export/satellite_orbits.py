"""The satellites' orbits and clocks as receivers report them, for programs that take SP3 files.

A nominal GLONASS satellite flies a uniform circle, which no GLONASS message can describe to better than some
centimetres; a table of its places can. Places are those of the antenna's phase centre, as on the bus. Where
satellites fly their broadcast messages the navigation file is exact, and a table is not: it is smooth where
one message gives way to the next.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.constellation.base import Constellation
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.tools.export.sp3 import Orbits

STEP_NS = 30 * gpstime.NS_PER_S
_MARGIN_NS = 6 * STEP_NS
"""Readers interpolate over eleven points or less."""

_HALF_S = 0.5


def reported(constellations: Mapping[str, Constellation], span_ns: tuple[int, int]) -> Orbits:
    """Orbits of satellites by RINEX letter, from before the first to after the last instant of a span."""
    first, last = (t // STEP_NS * STEP_NS for t in span_ns)
    t_ns = np.arange(first - _MARGIN_NS, last + STEP_NS + _MARGIN_NS + 1, STEP_NS)
    parts = [_sampled(constellation, t_ns) for constellation in constellations.values()]
    index = np.concatenate([c.index for c in constellations.values()])
    return Orbits(
        "M" if len(constellations) > 1 else next(iter(constellations)),
        tuple(satellites.name(i) for i in index),
        t_ns,
        np.concatenate([position for position, _ in parts], axis=1),
        None,
        np.concatenate([clock for _, clock in parts], axis=1),
        ("Satellites as the receivers of a bench report them:", "antenna phase centres, WGS-84"),
    )


def _sampled(constellation: Constellation, t_ns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (t, n, 3) [m] and clocks (t, n) [s], nan where no message is valid.

    An SP3 clock is without the orbit's periodic relativity, -2 r.v / c^2 (IS-GPS-200, 20.3.3.3.3.1, as
    vectors), and without the group delay of one signal.
    """
    place, clock_m, broadcast = constellation.sample(t_ns, np.array((-_HALF_S, 0.0, _HALF_S)))
    velocity = (place[:, 2] - place[:, 0]) / (2 * _HALF_S)
    relativity_s = -2 * np.einsum("tni,tni->tn", place[:, 1], velocity) / LIGHT_MPS**2
    clock_s = (clock_m[:, 1] + broadcast.group_delay_m) / LIGHT_MPS - relativity_s
    missing = ~broadcast.available
    return np.where(missing[..., None], np.nan, place[:, 1]), np.where(missing, np.nan, clock_s)
