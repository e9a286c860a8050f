"""The satellites' orbits and clocks, for programs that take SP3 files, ours among them.

A nominal GLONASS satellite flies a uniform circle, which no GLONASS message can describe to better than some
centimetres; a table of its places can. Where satellites fly their broadcast messages the navigation file is
exact, and a table is not: it is smooth where one message gives way to the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.constellation import phase_centre
from gnss_hil.emulator.constellation.base import Constellation
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.earth.sun_moon import sun_ecef_m
from gnss_hil.tools.export.run_data import Array, Numbers
from gnss_hil.tools.export.sp3 import Orbits

_OFTEN_NS, _SELDOM_NS = 30 * gpstime.NS_PER_S, 300 * gpstime.NS_PER_S
_MARGIN = 6
"""Instants before and after a span: readers interpolate over eleven points or less."""

_HALF_S = 0.5


def antennas(sky: Mapping[str, Constellation], span_ns: tuple[int, int]) -> Orbits:
    """Phase centres of the antennas of satellites by RINEX letter, which single-point programs want, from
    before the first to after the last instant of a span."""
    comments = "The satellites of a bench:", "antenna phase centres, WGS-84"
    return _orbits(sky, _grid(span_ns, _OFTEN_NS), comments)


def centres_of_mass(sky: Mapping[str, Constellation], span_ns: tuple[int, int], about: str) -> Orbits:
    """The same as agencies publish it and `--sp3` takes it; without those of unknown antennas on that day.

    about   a comment
    """
    found = _orbits(sky, _grid(span_ns, _SELDOM_NS), (about, "centres of mass, WGS-84"))
    first_ns = int(found.t_ns[0])
    index = [satellites.parse(name) for name in found.names]
    offset_m = phase_centre.offsets_m(gpstime.to_calendar(first_ns).date())[index]
    known = np.flatnonzero(np.isfinite(offset_m).all(axis=1))
    sun_m = sun_ecef_m(found.t_ns, gpstime.leap_seconds(first_ns))[:, None]
    return replace(
        found,
        names=tuple(found.names[n] for n in known),
        position_m=phase_centre.antenna_m(found.position_m[:, known], sun_m, -offset_m[known]),
        clock_s=None if found.clock_s is None else found.clock_s[:, known],
    )


def _grid(span_ns: tuple[int, int], step_ns: int) -> Numbers:
    """Instants (t,) [ns] on whole steps, around a span."""
    first, last = (t // step_ns * step_ns for t in span_ns)
    return np.arange(first - _MARGIN * step_ns, last + (_MARGIN + 1) * step_ns + 1, step_ns)


def _orbits(sky: Mapping[str, Constellation], t_ns: Numbers, comments: tuple[str, ...]) -> Orbits:
    parts = [_sampled(constellation, t_ns) for constellation in sky.values()]
    index = np.concatenate([c.index for c in sky.values()])
    return Orbits(
        "M" if len(sky) > 1 else next(iter(sky)),
        tuple(satellites.name(i) for i in index),
        t_ns,
        np.concatenate([position for position, _ in parts], axis=1),
        None,
        np.concatenate([clock for _, clock in parts], axis=1),
        comments,
    )


def _sampled(constellation: Constellation, t_ns: Numbers) -> tuple[Array, Array]:
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
