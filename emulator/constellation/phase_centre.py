"""From a satellite's centre of mass to the phase centre of its transmitting antenna.

Precise orbits are of the one, broadcast orbits and pseudoranges belong to the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.constellation import antenna_offsets as tables
from gnss_hil.emulator.constellation.space_vehicles import gps_types, gps_vehicles


def axes_ecef(pos_m: F64, sun_m: F64) -> F64:
    """Axes of satellites that steer in yaw: rows x, y, z of (..., 3, 3), the satellite's from the given axes.

    pos_m   (..., 3) satellite, geocentric [m];  sun_m (..., 3) the Sun, geocentric, in the same axes [m]
    z points to the Earth's centre, y along the solar arrays' axis, z x Sun, and x completes them: the Sun is
    on its side. Where the Sun is exactly above or below, x is undefined and zero.
    Source: O. Montenbruck et al., GNSS satellite geometry and attitude models, Adv. Space Res. 56 (2015),
    section 3: nominal yaw steering, axes of the IGS for all blocks
    """
    z = -pos_m / np.linalg.norm(pos_m, axis=-1, keepdims=True)
    y = np.cross(z, sun_m - pos_m)
    size = np.linalg.norm(y, axis=-1, keepdims=True)
    y = np.divide(y, size, out=np.zeros_like(y), where=size > 0)
    return np.stack((np.cross(y, z), y, z), axis=-2)


def antenna_m(pos_m: F64, sun_m: F64, offset_m: F64) -> F64:
    """Phase centres (..., 3) [m] of satellites at pos_m (..., 3), the Sun at sun_m (..., 3).

    offset_m  (..., 3) phase centre in the satellite's axes [m]
    """
    return pos_m + np.einsum("...ij,...i->...j", axes_ecef(pos_m, sun_m), offset_m)


def offsets_m(day: date) -> F64:
    """Phase centres (SATELLITES, 3) [m] by satellite index, in the satellite's axes; nan where it is unknown.

    Sources: `antenna_offsets`
    """
    offsets = np.full((satellites.SATELLITES, 3), np.nan)
    types = gps_types()
    for number, vehicle in gps_vehicles(day).items():
        _, x_m, z_m = types[vehicle]
        if vehicle == "62" and day >= date.fromisoformat(tables.G062_Z_M[0][0]):
            z_m = _in_force(tables.G062_Z_M, day)
        offsets[satellites.index(satellites.GPS, number)] = x_m, 0.0, z_m
    first = int(satellites.index(satellites.GLONASS, 1))
    z_m = _in_force(tables.GLONASS_M_Z_M, day)
    offsets[first : first + satellites.NUMBERS - 1] = tables.GLONASS_M_X_M, 0.0, z_m
    for slot, (until, z_m) in tables.GLONASS_FIRST.items():
        if day < date.fromisoformat(until):
            offsets[satellites.index(satellites.GLONASS, slot)] = 0.0, 0.0, z_m
    return offsets


def _in_force(rows: Sequence[tuple[str, float]], day: date) -> float:
    """The last value that began by a day; the first one before that."""
    begun = [value for since, value in rows if date.fromisoformat(since) <= day]
    return begun[-1] if begun else rows[0][1]
