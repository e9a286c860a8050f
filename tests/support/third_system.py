"""A run with a satellite system of the test's own: its rows are added to the tables, nothing else is.

`python -m tests.support.third_system ...` is `gnss-hil ...` where the system KEPLER exists. Rows come
before anything reads the tables, as if they stood in the files.
"""

from __future__ import annotations

import sys

import numpy as np

from gnss_hil.dbc.common.signals import SIGNALS, Signal
from gnss_hil.dbc.common.systems import SYSTEMS, System
from gnss_hil.emulator.signal.powers import POWERS, Power

KEPLER = System("kepler", "K", 7, 24, 29_600_000.0, time_offset_item=9, source="made up")
K1 = Signal("K1", "kepler", 8, 1_589.742e6, 0.0, 2.046e6, "1K", source="made up")
OFFSET_NS = 123.0
INCLINATION_DEG, PLANES, PER_PLANE = 56.0, 3, 8


def add_rows() -> None:
    """Rows of the contract, of the transmitters and of the constellations, in that order."""
    SYSTEMS[KEPLER.name], SIGNALS[K1.name] = KEPLER, K1
    POWERS[K1.name] = Power(-157.0, "made up")
    from gnss_hil.emulator.constellation.registry import MAKERS, Maker

    MAKERS[KEPLER.name] = Maker(KEPLER.name, nominal_kepler)


def nominal_kepler(start_ns: int):
    """A Walker constellation 24/3/1 of circular orbits, nodes at rest among the stars."""
    from gnss_hil.dbc.common import satellites
    from gnss_hil.emulator.constellation.nominal import NominalConstellation
    from gnss_hil.emulator.earth.constants import MU_M3PS2, ROTATION_RPS

    plane, place = np.divmod(np.arange(PLANES * PER_PLANE), PER_PLANE)
    return NominalConstellation(
        index=satellites.index(KEPLER.value, 1 + np.arange(PLANES * PER_PLANE)),
        frequency=np.zeros(PLANES * PER_PLANE, np.int64),
        radius_m=KEPLER.orbit_radius_m,
        inclination_rad=np.deg2rad(INCLINATION_DEG),
        epoch_ns=start_ns,
        node_rad=2 * np.pi * plane / PLANES,
        latitude_rad=2 * np.pi * (place / PER_PLANE + plane / (PLANES * PER_PLANE)),
        node_rps=-ROTATION_RPS,
        latitude_rps=(MU_M3PS2 / KEPLER.orbit_radius_m**3) ** 0.5,
    )


if __name__ == "__main__":
    add_rows()
    from gnss_hil.tools.command_line.main import main

    sys.exit(main(sys.argv[1:]))
