"""Nominal constellations: the slots the systems are built for, every slot taken, every satellite healthy.

Orbits are circular and uniform. A slot is known by the longitude of its ascending node and its argument
of latitude at an epoch, and by the constant rates of both; nothing is integrated. Satellite clocks are
invented, small and fixed by the satellite's number.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from dbc import gpstime, satellites
from emulator.world.constellation import Array, Broadcast
from emulator.world.earth import LIGHT_MPS, MU_M3PS2, ROTATION_RPS, sidereal_angle_rad

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

_GPS_AXIS_M = 26_559_700.0
_GPS_INCLINATION_DEG = 55.0
"""GPS SPS Performance Standard, 4th edition, table 3.2-2."""

_GPS_NODE_RPS = -2.6e-9 * np.pi
"""Precession of the node in inertial space: the reference rate of IS-GPS-200, table 30-I."""

_GLONASS_EPOCH_UTC)
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
    )
