"""The ionosphere of a run: vertical content over every place, and its profile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.signal.bands import L1_HZ
from gnss_hil.emulator.signal.ionosphere.delay import tecu_of_delay_m
from gnss_hil.emulator.signal.ionosphere.klobuchar import Coefficients, vertical_delay_s
from gnss_hil.emulator.signal.ionosphere.maps import Maps, vertical_tecu
from gnss_hil.emulator.signal.ionosphere.profile import Profile

Array = NDArray[np.float64]

Vertical = Callable[[int, Array | float, Array, Array], Array]
"""(t_ns, later_s, lat_rad, lon_rad) -> vertical content [TECU]; they broadcast; latitudes are geocentric."""

_DAY_NS = 86_400_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """Electrons around the Earth. They belong to the sky: no draw, no craft, no receiver is in them."""

    profile: Profile
    vertical_tecu: Vertical


def of_coefficients(coefficients: Coefficients, profile: Profile) -> Field:
    """Field of broadcast coefficients. Their latitude is geodetic; that the geocentric one is read instead,
    0.19 deg off at most, is nothing to a model that removes half of the effect."""

    def vertical(t_ns: int, later_s: Array | float, lat_rad: Array, lon_rad: Array) -> Array:
        delay_s = vertical_delay_s(coefficients, t_ns % _DAY_NS * 1e-9 + later_s, lat_rad, lon_rad)
        return tecu_of_delay_m(LIGHT_MPS * delay_s, L1_HZ)

    return Field(profile, vertical)


def of_maps(maps: Maps, profile: Profile) -> Field:
    """Field of measured maps."""
    return Field(profile, lambda *place: vertical_tecu(maps, *place))
