"""The ionosphere of a run: vertical content over every place, and its profile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.signal.bands import L1_HZ
from gnss_hil.emulator.signal.ionosphere.delay import tecu_of_delay_m
from gnss_hil.emulator.signal.ionosphere.klobuchar import Coefficients, vertical_delay_s
from gnss_hil.emulator.signal.ionosphere.maps import Maps, vertical_tecu
from gnss_hil.emulator.signal.ionosphere.profile import Profile

Vertical = Callable[[int, F64 | float, F64, F64], F64]
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

    def vertical(t_ns: int, later_s: F64 | float, lat_rad: F64, lon_rad: F64) -> F64:
        delay_s = vertical_delay_s(coefficients, t_ns % _DAY_NS * 1e-9 + later_s, lat_rad, lon_rad)
        return tecu_of_delay_m(LIGHT_MPS * delay_s, L1_HZ)

    return Field(profile, vertical)


def of_maps(maps: Maps, profile: Profile) -> Field:
    """Field of measured maps."""
    return Field(profile, lambda *place: vertical_tecu(maps, *place))
