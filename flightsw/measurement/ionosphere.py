"""Ionospheric delay of rays from a craft at any height, and how far it is known.

Broadcast coefficients give the vertical delay on the ground. A craft in orbit has only what is above it, and
looks below its horizon too; so electrons are laid around the Earth, a Chapman layer of usual height and
thickness and a thin plasmasphere. The delay is their integral along the ray from antenna to satellite, times
the vertical delay of the place where the ray meets them on the whole. Coefficients leave half of the delay,
and how much of it lies above an orbit is not known better: the whole is known to a factor, the same for all
rays, whose deviation is `FACTOR`; what a ray has for itself, to `OWN` of it.

Of rates that share is not all. A ray that grazes the layer scans it: from far above its lowest point sinks or
rises by kilometres a second, and where its delay is largest the rate that is modelled is zero, while layers
differ in height and thickness. What a ray is off by itself, OWN I g, is another in another height: g has
unit variance and is alike over a scale height H, with correlation exp(-dh^2 / 2 H^2), so that its slope has
the variance 1 / H^2, and the rate OWN (I' g + I g') that of OWN^2 (I'^2 + (I h' / H)^2), where h is the
height of the ray's lowest point.

Sources: IS-GPS-200, 20.3.3.5.2.5 (coefficients; 50 % of the delay, RMS); Chapman, Proc. Phys. Soc. 43 (1931)
26; Montenbruck & Gill, J. Navigation 49 (2002) 2 (what of it a low orbit has above it; layer of this size)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.measurement.range_model import Rays
from gnss_hil.flightsw.orbit.earth import EQUATOR_M, FLATTENING, LIGHT_MPS
from gnss_hil.flightsw.records.epoch import Coefficients

PEAK_M, SCALE_M = 350e3, 80e3
"""Height and scale of the layer. Modelled: usual values; nothing emulated was fitted."""

PLASMASPHERE, PLASMASPHERE_M = 0.1, 2_000e3
"""Share of the content that is spread higher up, from the peak on, and its scale. Modelled: a tenth lies
above 1,336 km by day, E. Yizengaw et al., J. Atm. Solar-Terr. Phys. 70 (2008) 1541."""

FACTOR = 0.6
"""1 sigma of the factor that all delays of an epoch have in common."""

OWN = 0.2
"""1 sigma of what a ray's delay is off besides, as a share of it."""

FLOOR_M = 0.3
"""1 sigma of the vertical delay that no coefficients promise."""

ASIDE_S = 5.0
"""So long before and after an epoch rays are taken for their rates. A ray's way through a shell that it has
just entered grows as a root does, and from near the rate would be that; in so long it scans a shell or two,
and the curves of orbits, the same before and after, do not count."""

_EDGES_M: F64 = np.concatenate(
    (np.arange(80e3, 800e3, 30e3), np.arange(800e3, 1_400e3, 100e3), np.geomspace(1_400e3, 20_000e3, 10)),
    dtype=np.float64,
)
"""Heights between the shells that electrons are taken to fill evenly."""


def _above(height_m: F64) -> F64:
    """Share of the vertical content above heights."""
    fine = np.arange(60e3, 3_000e3, 1e3)
    z = (fine - PEAK_M) / SCALE_M
    layer = np.cumsum(np.exp(0.5 * (1 - z - np.exp(-z))))
    within = np.interp(height_m, fine, layer / layer[-1])
    sphere = np.exp(-np.maximum(height_m - PEAK_M, 0.0) / PLASMASPHERE_M)
    return (1 - PLASMASPHERE) * (1 - within) + PLASMASPHERE * sphere


_DENSITY: F64 = -np.diff(_above(_EDGES_M)) / np.diff(_EDGES_M)
"""Of each shell, over the vertical content [1/m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ionosphere:
    """As broadcast, at a GPS second of the day."""

    broadcast: Coefficients
    second_of_day: float


USUAL = Coefficients(np.array([2.0e-8, 1.0e-8, -6.0e-8, -6.0e-8]), np.array([1.1e5, 0.0, -2.0e5, 0.0]))
"""Of a day of middling activity, for receivers that report none. Modelled: round numbers among those that GPS
has broadcast."""


@dataclass(frozen=True, slots=True, eq=False)
class Delay:
    """Of rays (n,), of the reference system's first signal.

    modelled_m   the delay
    common_m     1 sigma of what it is off in all rays together
    own_m2       variance of what each is off by itself
    """

    modelled_m: F64
    common_m: F64
    own_m2: F64


def delay(ionosphere: Ionosphere, antenna_m: F64, los: F64, distance_m: F64) -> Delay:
    """Of rays from antennas (3, n) in directions (3, n) to satellites at distances (n,), ECEF."""
    share, where = _content(antenna_m, los, distance_m)
    vertical_m = vertical_delay_m(ionosphere, where)
    modelled = share * vertical_m
    return Delay(modelled, FACTOR * modelled + FLOOR_M * share, (OWN * modelled) ** 2)


def delay_rate(ionosphere: Ionosphere, rays: Rays, antenna_mps: F64, sv_mps: F64) -> Delay:
    """Of the same rays a second: antennas and satellites move by (3, n) [m/s]. [m/s], [m^2/s^2]"""
    ends, lowest_m = [], []
    for dt_s in (-ASIDE_S, ASIDE_S):
        antenna_m = rays.antenna_m + dt_s * antenna_mps
        away_m = rays.pos_sv_m + dt_s * sv_mps - antenna_m
        distance_m = np.sqrt(np.add.reduce(away_m * away_m))
        los = away_m / distance_m
        ends.append(delay(ionosphere, antenna_m, los, distance_m))
        lowest_m.append(_lowest_m(antenna_m, los, distance_m))
    before, after = ends
    between_s = 2 * ASIDE_S
    rate = (after.modelled_m - before.modelled_m) / between_s
    sinks_mps = (lowest_m[1] - lowest_m[0]) / between_s
    scanned = 0.5 * (before.modelled_m + after.modelled_m) * sinks_mps / SCALE_M
    common = (after.common_m - before.common_m) / between_s
    return Delay(rate, common, OWN**2 * (rate**2 + scanned**2))


def _lowest_m(antenna_m: F64, los: F64, distance_m: F64) -> F64:
    """(n,) distance from the Earth's centre where rays are closest to it: of those that begin upwards, at
    the antenna."""
    begin = np.add.reduce(antenna_m * los)
    on_ray = antenna_m + los * np.clip(-begin, 0.0, distance_m)
    return np.sqrt(np.add.reduce(on_ray * on_ray))


def _content(antenna_m: F64, los: F64, distance_m: F64) -> tuple[F64, F64]:
    """Content (n,) along rays over the vertical content of all, and the places (3, n) where on the whole
    they meet it. Exact for even shells: what of a ray is inside a sphere lies symmetrically about its point
    closest to the Earth's centre."""
    begin = np.add.reduce(antenna_m * los)  # of the ray, counted from that point
    square = np.add.reduce(antenna_m * antenna_m)
    surface_m = EQUATOR_M * (1 - FLATTENING * antenna_m[2] ** 2 / np.maximum(square, 1.0))
    inside = np.sqrt(np.maximum((surface_m + _EDGES_M[:, None]) ** 2 - (square - begin * begin), 0.0))
    enter = np.clip(begin, -inside, inside)
    leave = np.clip(begin + distance_m, -inside, inside)
    total = _DENSITY @ np.diff(leave - enter, axis=0)
    moment = 0.5 * (_DENSITY @ np.diff(leave * leave - enter * enter, axis=0))
    middle = np.divide(moment, total, out=begin.copy(), where=total > 0)
    return total, antenna_m + los * (middle - begin)


def vertical_delay_m(ionosphere: Ionosphere, where_m: F64) -> F64:
    """(n,) from the ground up over places (3, n), ECEF, by the broadcast coefficients."""
    x, y, z = where_m
    latitude = np.clip(np.arctan2(z, np.hypot(x, y)) / np.pi, -0.416, 0.416)
    longitude = np.arctan2(y, x) / np.pi
    magnetic = latitude + 0.064 * np.cos((longitude - 1.617) * np.pi)
    powers = magnetic ** np.arange(4)[:, None]
    amplitude_s = np.maximum(ionosphere.broadcast.alpha @ powers, 0.0)
    period_s = np.maximum(ionosphere.broadcast.beta @ powers, 72_000.0)
    local_s = (43_200.0 * longitude + ionosphere.second_of_day) % 86_400.0
    phase = 2 * np.pi * (local_s - 50_400.0) / period_s
    day = np.where(np.abs(phase) < 1.57, 1 - phase**2 / 2 + phase**4 / 24, 0.0)
    return LIGHT_MPS * (5e-9 + amplitude_s * day)
