"""Nominal constellations: the slots the systems are built for, every slot taken, every satellite healthy.

Orbits are circular and uniform. A slot is known by the longitude of its ascending node and its argument
of latitude at an epoch, and by the constant rates of both; nothing is integrated. Satellite clocks and the
delays between their carriers are invented, small and fixed by the satellite's number.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.constellation.base import Broadcast
from gnss_hil.emulator.earth.constants import LIGHT_MPS, MU_M3PS2, ROTATION_RPS, sidereal_angle_rad

_GPS_SLOTS_DEG = (
    (272.847, (268.126, 161.786, 11.676, 41.806)),
    (332.847, (80.956, 173.336, 309.976, 204.376)),
    (32.847, (111.876, 11.796, 339.666, 241.556)),
    (92.847, (135.226, 265.446, 35.156, 167.356)),
    (152.847, (197.046, 302.596, 66.066, 333.686)),
    (212.847, (238.886, 345.226, 105.206, 135.346)),
)
"""Planes A to F: right ascension of the node, arguments of latitude of slots 1 to 4.
GPS SPS Performance Standard, 4th edition (2008), table 3.2-1."""

_GPS_EPOCH = datetime(1993, 7, 1)
_GPS_GREENWICH_DEG = 15 * (18 + 36 / 60 + 14.4 / 3600)
"""Greenwich hour angle of the table's epoch, from the same table."""

_GPS_INCLINATION_DEG = 55.0
"""GPS SPS Performance Standard, 4th edition, table 3.2-2."""

_GPS_NODE_RPS = -2.6e-9 * np.pi
"""Precession of the node in inertial space: the reference rate of IS-GPS-200, table 30-I."""

_GLONASS_EPOCH_UTC = datetime(1982, 12, 31, 21)
"""1983-01-01 00:00 Moscow time. This and the next five: GLONASS ICD 5.1 (2008), 5.1 and appendix."""
_GLONASS_NODE_DEG = 251 + 15 / 60
_GLONASS_LATITUDE_DEG = 145 + 26 / 60 + 37 / 3600
_GLONASS_INCLINATION_DEG = 64.8
_GLONASS_PERIOD_S = 11 * 3600 + 15 * 60 + 44
_GLONASS_NODE_RPS = -0.00059251 / 86400

GLONASS_FREQUENCY = (1, -4, 5, 6, 1, -4, 5, 6, -2, -7, 0, -1, -2, -7, 0, -1, 4, -3, 3, 2, 4, -3, 3, 2)
"""Frequency numbers of slots 1 to 24 as flown; antipodal satellites share one (GLONASS ICD 5.1, 3.3.1.1)."""

_CLOCK_OFFSET_S = 1e-4
_CLOCK_RATE = 5e-12
"""Largest clock offset and rate of a nominal satellite: the size of the real ones (modelled)."""

_GROUP_DELAY_S, _BAND_DELAY_S = 10e-9, 6e-9
"""Largest T_GD of a nominal GPS satellite, Delta tau of a GLONASS one: the size of real ones (modelled)."""

_GOLDEN = (5**0.5 - 1) / 2


@dataclass(frozen=True, slots=True, eq=False)
class NominalConstellation:
    """Circular orbits of one size, inclination and speed.

    index            (n,) satellite index
    frequency        (n,) GLONASS frequency number
    epoch_ns         GPS time the angles and clock offsets refer to [ns]; near the run, or nanometres
                     of angle drown in the rounding of decades of seconds
    node_rad         (n,) longitude of the ascending node from Greenwich and
    latitude_rad     (n,) argument of latitude at the epoch [rad]
    node_rps, latitude_rps   their rates [rad/s]
    group_delay_s, band_delay_s   largest delays between carriers, of either sign, inside the clock of the
                     first signal and beside it, as in `gnss_hil.emulator.constellation.base.Broadcast` [s]
    """

    index: I64
    frequency: I64
    radius_m: float
    inclination_rad: float
    epoch_ns: int
    node_rad: F64
    latitude_rad: F64
    node_rps: float
    latitude_rps: float
    group_delay_s: float = 0.0
    band_delay_s: float = 0.0

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Broadcast]:
        """See `Constellation.sample`."""
        age_s = ((middles_ns - self.epoch_ns) / gpstime.NS_PER_S)[:, None, None] + nodes_s[:, None]
        node = self.node_rad + self.node_rps * age_s
        latitude = self.latitude_rad + self.latitude_rps * age_s
        along, across = np.cos(latitude), np.sin(latitude) * np.cos(self.inclination_rad)
        positions = self.radius_m * np.stack(
            (
                along * np.cos(node) - across * np.sin(node),
                along * np.sin(node) + across * np.cos(node),
                np.sin(latitude) * np.sin(self.inclination_rad),
            ),
            axis=-1,
        )
        offset_s, rate = self.clocks
        return positions, LIGHT_MPS * (offset_s + rate * age_s), self._broadcast(len(middles_ns))

    @property
    def clocks(self) -> tuple[F64, F64]:
        """Offsets [s] at the epoch and rates [s/s] (n,) of the clocks for the first signal.

        Multiples of the golden ratio, less whole ones, spread them evenly over their ranges.
        """
        place = self.index.astype(np.float64)
        return (
            _CLOCK_OFFSET_S * (2 * (place * _GOLDEN % 1.0) - 1),
            _CLOCK_RATE * (2 * (place * _GOLDEN**2 % 1.0) - 1),
        )

    @property
    def delays_s(self) -> tuple[F64, F64]:
        """Group delays and delays of the second band (n,)."""
        spread = 2 * (self.index.astype(np.float64) * _GOLDEN**3 % 1.0) - 1
        return self.group_delay_s * spread, self.band_delay_s * spread

    def _broadcast(self, segments: int) -> Broadcast:
        shape = (segments, len(self.index))
        zeros = np.zeros(shape, np.int64)
        yes = np.ones(shape, bool)
        frequency = np.broadcast_to(self.frequency, shape)
        group_m, band_m = (np.broadcast_to(LIGHT_MPS * delay_s, shape) for delay_s in self.delays_s)
        return Broadcast(yes, yes, frequency, zeros, zeros, zeros, group_m, band_m)


def _advanced(angle_rad: F64, rate_rps: float, age_ns: int) -> F64:
    """Angles (n,) [rad] after age_ns, within one turn."""
    return (angle_rad + rate_rps * (age_ns / gpstime.NS_PER_S)) % (2 * np.pi)


def nominal_gps(start_ns: int) -> NominalConstellation:
    """The 24 slots of GPS; PRN 1 to 24 in the order A1 to A4, B1 ... F4 (real numbers change with launches).

    The ground tracks repeat: two revolutions while the Earth turns once under the precessing plane.
    """
    ascension = np.repeat([plane for plane, _ in _GPS_SLOTS_DEG], 4)
    latitude = np.concatenate([slots for _, slots in _GPS_SLOTS_DEG])
    node_rps = _GPS_NODE_RPS - ROTATION_RPS
    age_ns = start_ns - gpstime.from_utc(_GPS_EPOCH)
    return NominalConstellation(
        index=satellites.index(satellites.GPS, np.arange(1, 25)),
        frequency=np.zeros(24, np.int64),
        radius_m=SYSTEMS["gps"].orbit_radius_m,
        inclination_rad=np.deg2rad(_GPS_INCLINATION_DEG),
        epoch_ns=start_ns,
        node_rad=_advanced(np.deg2rad(ascension - _GPS_GREENWICH_DEG), node_rps, age_ns),
        latitude_rad=_advanced(np.deg2rad(latitude), -2 * node_rps, age_ns),
        node_rps=node_rps,
        latitude_rps=-2 * node_rps,
        group_delay_s=_GROUP_DELAY_S,
    )


def nominal_glonass(start_ns: int) -> NominalConstellation:
    """The 24 slots of GLONASS, numbers as in the system: 1 to 8 in the first plane and so on."""
    slot = np.arange(1, 25)
    plane = (slot - 1) // 8
    latitude = _GLONASS_LATITUDE_DEG + 15 * (27 - 3 * slot + 25 * plane)
    epoch_ns = gpstime.from_utc(_GLONASS_EPOCH_UTC)
    greenwich = sidereal_angle_rad(epoch_ns, gpstime.leap_seconds(epoch_ns))
    latitude_rps = 2 * np.pi / _GLONASS_PERIOD_S
    node_rps = _GLONASS_NODE_RPS - ROTATION_RPS
    age_ns = start_ns - epoch_ns
    return NominalConstellation(
        index=satellites.index(satellites.GLONASS, slot),
        frequency=np.array(GLONASS_FREQUENCY),
        radius_m=(MU_M3PS2 / latitude_rps**2) ** (1 / 3),
        inclination_rad=np.deg2rad(_GLONASS_INCLINATION_DEG),
        epoch_ns=start_ns,
        node_rad=_advanced(np.deg2rad(_GLONASS_NODE_DEG + 120 * plane) - greenwich, node_rps, age_ns),
        latitude_rad=_advanced(np.deg2rad(latitude), latitude_rps, age_ns),
        node_rps=node_rps,
        latitude_rps=latitude_rps,
        band_delay_s=_BAND_DELAY_S,
    )
