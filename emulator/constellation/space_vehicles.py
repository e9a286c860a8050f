"""Which GPS space vehicle has which number on a day, and of which type it is: the tables read.

Sources: `antenna_offsets`
"""

from __future__ import annotations

from datetime import date

from gnss_hil.emulator.constellation import antenna_offsets as tables


def gps_vehicles(day: date) -> dict[int, str]:
    """PRN -> space vehicle that has it, or had it last, on that day."""
    found = {}
    words = tables.GPS_NUMBERS.split()
    for vehicle, since, number in zip(words[::3], words[1::3], words[2::3], strict=True):
        if date.fromisoformat(since) <= day:
            found[int(number)] = vehicle
    return found


def gps_types() -> dict[str, tuple[str, float, float]]:
    """Space vehicle -> its type, x and z of its antenna's phase centre in the satellite's axes [m]."""
    found: dict[str, tuple[str, float, float]] = {}
    kind, x_m = "", "nan"
    for line in tables.GPS_OFFSETS.strip().split("\n    "):
        words = line.split()
        if not line.startswith(" "):
            (kind, x_m), words = words[:2], words[2:]
        for vehicle, z_m in zip(words[::2], words[1::2], strict=True):
            found[vehicle] = kind, float(x_m), float(z_m)
    return found
