"""Where an almanac puts the satellites of a sky: what receivers know of those they do not track.

An almanac is kilometres off when it is new, tens after weeks, and worse after a manoeuvre: nothing here
repairs that. PZ-90 is taken for WGS-84, metres away at most.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.constellation.almanac import glonass
from gnss_hil.emulator.constellation.broadcast import gps
from gnss_hil.emulator.files import almanacs
from gnss_hil.emulator.files.almanacs import Almanac, nearest_of_each
from gnss_hil.emulator.files.text import FileError

_NOT_IN_ALMANACS: dict[str, F64] = dict.fromkeys(
    ("delta_n", "idot", "cus", "cuc", "crs", "crc", "cis", "cic"), np.zeros(())
)
"""Elements that ephemerides have and almanacs take for zero. IS-GPS-200, 20.3.3.5.2.1."""

_STEP_S = 1.0
"""Between the two places a velocity is taken from; the change of acceleration makes 4 um/s of that."""


@dataclass(frozen=True, slots=True, eq=False)
class Predictions:
    """Satellites (p,) at one instant.

    pos_ecef_m, vel_ecef_mps  (p, 3) ECEF of the instant
    healthy                   (p,) bool
    age_h                     (p,) hours to the almanac's reference, whichever side
    """

    pos_ecef_m: F64
    vel_ecef_mps: F64
    healthy: Bool
    age_h: F64


@dataclass(frozen=True, slots=True, eq=False)
class HeldAlmanac:
    """An almanac by the rows of a sky.

    known   (n,) bool, the almanac has the satellite
    system  (n,) of each row
    column  (n,) the satellite's column in the almanac of its system; 0 where it is not known
    parts   almanac by system
    """

    known: Bool
    system: I64
    column: I64
    parts: dict[int, Almanac]

    def at(self, rows: I64, t_ns: I64 | int) -> Predictions:
        """Predictions for known rows (p,) of the sky at GPS times t_ns, (p,) or one."""
        t_ns = np.broadcast_to(t_ns, rows.shape)
        predicted = Predictions(
            np.empty((len(rows), 3)), np.empty((len(rows), 3)), np.empty(len(rows), bool), np.empty(len(rows))
        )
        for system, part in self.parts.items():
            mine = np.flatnonzero(self.system[rows] == system)
            if not len(mine):
                continue
            columns = self.column[rows[mine]]
            since_s = (t_ns[mine] - part.reference_ns[columns]) / gpstime.NS_PER_S
            elements = {name: values[columns] for name, values in part.elements.items()}
            predicted.pos_ecef_m[mine], predicted.vel_ecef_mps[mine] = _ORBIT[system](
                elements, part.reference_ns[columns], since_s
            )
            predicted.healthy[mine] = part.healthy[columns]
            predicted.age_h[mine] = np.abs(since_s) / 3600
        return predicted


def _gps(elements: dict[str, F64], toa_ns: I64, since_s: F64) -> tuple[F64, F64]:
    """IS-GPS-200, 20.3.3.5.2: the algorithm of ephemerides with fewer elements."""
    toa_s = toa_ns % gpstime.NS_PER_WEEK / gpstime.NS_PER_S
    steps_s = _STEP_S * np.array((-0.5, 0.0, 0.5))[:, None]
    (before, pos, after), _ = gps.orbit(elements | _NOT_IN_ALMANACS, toa_s, since_s + steps_s)
    return pos, (after - before) / _STEP_S


def _glonass(elements: dict[str, F64], node_ns: I64, since_s: F64) -> tuple[F64, F64]:
    return glonass.orbit(elements, since_s)


_ORBIT: dict[int, Callable[[dict[str, F64], I64, F64], tuple[F64, F64]]] = {
    satellites.GPS: _gps,
    satellites.GLONASS: _glonass,
}
"""System -> positions and velocities (p, 3) from elements (p,), their reference (p,) and the time since."""


def hold(index: I64, found: Sequence[Almanac], near_ns: int) -> HeldAlmanac:
    """The almanacs `found` for the satellites (n,) of a sky; of a satellite in several the one nearest to GPS
    time near_ns has it, of equal ones the last."""
    parts = {}
    for system in dict.fromkeys(almanac.system for almanac in found):
        parts[system] = _joined([part for part in found if part.system == system], near_ns)
    system, number = satellites.system_of(index), satellites.number_of(index)
    known, column = np.zeros(len(index), bool), np.zeros(len(index), np.int64)
    for key, part in parts.items():
        place = np.minimum(np.searchsorted(part.number, number), len(part.number) - 1)
        mine = (system == key) & (part.number[place] == number)
        known |= mine
        column = np.where(mine, place, column)
    return HeldAlmanac(known, system, column, parts)


def read(paths: Sequence[Path], index: I64, near_ns: int) -> HeldAlmanac:
    """The almanac in files for the satellites (n,) of a sky, GPS weeks being those near near_ns.

    FileError in one line for a file's fault, or if it has no satellite of the sky.
    """
    held = hold(index, [almanacs.read(path, near_ns) for path in paths], near_ns)
    if not held.known.any():
        raise FileError(f"{', '.join(map(str, paths))}: no satellite of the sky is in it")
    return held


OLD_H = 7 * 24.0
"""Almanacs this far from a run are told: they are renewed every day, and wrong by more each."""


def remarks(held: HeldAlmanac, index: I64, near_ns: int) -> Iterator[str]:
    """What is odd about an almanac at near_ns for the satellites (n,) of a sky: a line each."""
    rows = np.flatnonzero(held.known)
    age_h = held.at(rows, near_ns).age_h
    old = age_h > OLD_H
    if old.any():
        yield (
            f"the almanac is up to {age_h.max() / 24:.0f} days from the run ({np.count_nonzero(old)} of "
            f"{len(rows)} satellites more than {OLD_H / 24:.0f})"
        )
    if not held.known.all():
        yield f"no entry of {satellites.listed(index[~held.known])}: receivers do not know of them"


def _joined(parts: Sequence[Almanac], near_ns: int) -> Almanac:
    """Almanacs of one system as one, each satellite's entry that which is nearest to near_ns; of two the
    later in order."""
    number = np.concatenate([part.number for part in parts])
    away_ns = np.abs(np.concatenate([part.reference_ns for part in parts]) - near_ns)
    keep = nearest_of_each(number, away_ns)
    return Almanac(
        parts[0].system,
        number[keep],
        np.concatenate([part.healthy for part in parts])[keep],
        np.concatenate([part.reference_ns for part in parts])[keep],
        {name: np.concatenate([part.elements[name] for part in parts])[keep] for name in parts[0].elements},
    )
