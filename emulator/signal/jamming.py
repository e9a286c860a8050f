"""Jammers in the link budget: where their power comes from, and how much of it a correlator keeps.

Behind a correlator a jammer of received power J is like white noise of density J k, where k [1/Hz] is the
overlap of its spectrum with the signal's. In the words of the textbooks k = 1 / (Q Rc), Rc the chipping rate.
Sources: J. Betz, Effect of Narrowband Interference on GPS Code Tracking Accuracy, ION NTM 2000; Kaplan &
Hegarty, Understanding GPS/GNSS, 3rd ed., 9.2 (Q = 1 for a tone, 1.5 for a matched spectrum, 2.22 for noise
from null to null).
The spectrum of a code is taken as smooth: the lines of a C/A code, 1 kHz apart, which a tone may hit, are not
modelled, nor is a front end that is driven out of its linear range.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.signal import antenna_patterns
from gnss_hil.emulator.signal.antenna_patterns import Receive
from gnss_hil.emulator.signal.bands import BY_SIGNAL
from gnss_hil.emulator.signal.geometry import norm
from gnss_hil.emulator.signal.visibility import (
    EQUATORIAL_RADIUS_M,
    POLAR_RADIUS_M,
    angles_rad,
    ray_height_m,
)

SMALL = 1e-2
"""Below it two terms of a series are good to 1e-11."""

Kind = Literal["noise", "tone", "matched"]


@dataclass(frozen=True, slots=True, eq=False)
class Jammers:
    """Jammers of a run, one row each; those at a place on the Earth first, then those fixed to the craft.

    place_ecef_m      (e, 3) where the first ones stand
    eirp_dbw          (e,) of each of these, right-handed and equal in all directions
    direction_body    (b, 3) unit vectors towards the others, in body axes
    received_dbw      (b,) power of each of these at an isotropic antenna
    kind              (j,) spectrum: "noise" flat over bandwidth_hz, "tone", or "matched": as a signal's
    centre_hz         (j,) middle of the spectrum
    bandwidth_hz      (j,) of noise
    on_ns             (j, 2) GPS time from which each is on, and until before which [ns]; None: always
    """

    place_ecef_m: F64
    eirp_dbw: F64
    direction_body: F64
    received_dbw: F64
    kind: tuple[Kind, ...]
    centre_hz: F64
    bandwidth_hz: F64
    on_ns: I64 | None = None


def place_ecef_m(latitude_rad: float, longitude_rad: float, height_m: float) -> F64:
    """ECEF coordinates (3,) [m] of a geodetic place on WGS-84.

    Source: NGA.STND.0036, 4.1 (closed form)
    """
    shrink = (POLAR_RADIUS_M / EQUATORIAL_RADIUS_M) ** 2
    sin, cos = np.sin(latitude_rad), np.cos(latitude_rad)
    normal_m = EQUATORIAL_RADIUS_M / np.sqrt(1 - (1 - shrink) * sin**2)
    across_m = (normal_m + height_m) * cos
    east, north = np.sin(longitude_rad), np.cos(longitude_rad)
    return np.array((across_m * north, across_m * east, (shrink * normal_m + height_m) * sin))


def _antiderivative(x: F64) -> F64:
    """Integral of sinc^2 from 0 to x, with sinc(x) = sin(pi x) / (pi x); odd, tends to 1/2.

    Source: by parts, with the sine integral of Abramowitz & Stegun, 5.2
    """
    from scipy.special import sici

    u = np.pi * np.where(x == 0, 1.0, x)
    return np.where(x == 0, 0.0, (sici(2 * u)[0] - np.sin(u) ** 2 / u) / np.pi)


def overlap_perhz(kind: Kind, offset_hz: F64, bandwidth_hz: float, chip_hz: F64) -> F64:
    """Spectral overlap [1/Hz] of a jammer of unit power with signals sinc^2(f / Rc) / Rc.

    offset_hz   (n,) centre of the jammer less the signals' carriers
    chip_hz     (n,) chipping rates Rc
    """
    x = offset_hz / chip_hz
    if kind == "tone":
        return np.sinc(x) ** 2 / chip_hz
    if kind == "noise":
        half = bandwidth_hz / 2 / chip_hz
        return (_antiderivative(x + half) - _antiderivative(x - half)) / bandwidth_hz
    # Two equal spectra apart by x chipping rates: the transform of the squared triangle.
    w = 2 * np.pi * x
    small = np.abs(w) < SMALL
    far = np.where(small, 1.0, w)
    # Where the quotient would cancel, the beginning of its series.
    return np.where(small, 2 / 3 - w**2 / 30, 4 * (1 - np.sin(far) / far) / far**2) / chip_hz


def overlaps_perhz(jammers: Jammers, signal: I64, frequency: I64) -> F64:
    """Overlaps (j, n) [1/Hz] with signals (n,) of these values on the bus and GLONASS frequency numbers."""
    carrier_hz = BY_SIGNAL.carrier_hz[signal] + frequency * BY_SIGNAL.spacing_hz[signal]
    chip_hz = LIGHT_MPS / BY_SIGNAL.chip_m[signal]
    rows = zip(jammers.kind, jammers.centre_hz, jammers.bandwidth_hz, strict=True)
    found = [overlap_perhz(kind, centre - carrier_hz, width, chip_hz) for kind, centre, width in rows]
    return np.array(found).reshape(-1, len(signal))


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """Jammers as they reach the craft at one instant.

    los_ecef    (j, 3) unit vectors towards them
    power_w     (j,) at an isotropic antenna; 0 where the Earth is in the way or it is off [W]
    """

    los_ecef: F64
    power_w: F64


def arrivals(jammers: Jammers, pos_ecef_m: F64, dcm_body_from_ecef: F64, t_ns: int = 0) -> Arrival:
    """Directions and powers at a craft at pos_ecef_m (3,) whose body axes are dcm_body_from_ecef (3, 3).

    t_ns   GPS time, which matters where jammers are on in time
    """
    towards = jammers.place_ecef_m - pos_ecef_m
    distance_m = norm(towards)
    placed = len(distance_m)
    wavelength_m = LIGHT_MPS / jammers.centre_hz[:placed]
    power_w = 10 ** (jammers.eirp_dbw / 10) * (wavelength_m / (4 * np.pi * distance_m)) ** 2
    power_w = np.where(ray_height_m(pos_ecef_m, towards) >= 0, power_w, 0.0)
    los = np.concatenate((towards / distance_m[:, None], jammers.direction_body @ dcm_body_from_ecef))
    power_w = np.concatenate((power_w, 10 ** (jammers.received_dbw / 10)))
    if jammers.on_ns is not None:
        power_w *= (jammers.on_ns[:, 0] <= t_ns) & (t_ns < jammers.on_ns[:, 1])
    return Arrival(los, power_w)


def density_wphz(arrival: Arrival, antennas: Receive, boresight_ecef: F64, overlap_perhz: F64) -> F64:
    """Equivalent noise density (m, n) [W/Hz] at the terminals of antennas with boresights (m, 3).

    overlap_perhz   (j, n) of `overlaps_perhz`
    """
    gain_dbi = antenna_patterns.gain_dbi(antennas, angles_rad(boresight_ecef, arrival.los_ecef))
    return (arrival.power_w * 10 ** (gain_dbi / 10)) @ overlap_perhz
