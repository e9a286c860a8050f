"""The navigation satellites above: where they are, what their clocks show, what they say of themselves.

A sky is made of constellations, one for each system. A constellation evaluates its ephemerides for many
segments at once; the sky keeps the result as polynomials, one minute each, and reads them every epoch.

Broadcast orbits and clocks *are* the truth here (modelled: no satellite flies them). Where one ephemeris
gives way to the next, the satellite jumps by what the two disagree, decimetres to metres, and says so by
another `ephemeris` number: a receiver cannot count cycles across that.

Step 1 of RU 2706636 C1: satellites with known orbits transmit at known times.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from emulator import scenario
from emulator.world.constellation import Array, Broadcast, Constellation
from emulator.world.earth import LIGHT_MPS
from emulator.world.navigation import from_files
from emulator.world.nominal import nominal_glonass, nominal_gps
from emulator.world.polynomials import NS_PER_S, Chunks, Grid

GRID = Grid(origin_ns=0, segment_ns=60 * NS_PER_S, margin_ns=2 * NS_PER_S, degree=7, per_chunk=30)
"""Ephemerides change on whole minutes of GPS time; 2 s beyond a segment still belong to its polynomial."""


@dataclass(frozen=True, slots=True, eq=False)
class SkyState:
    """All satellites of a sky at one instant; rows are the same satellites through a run.

    index             (n,) satellite index, `dbc.satellites`
    pos_ecef_m        (n, 3) antenna phase centre, WGS-84 ECEF axes of the instant [m]
    vel_ecef_mps      (n, 3) first and
    acc_ecef_mps2     (n, 3) second time derivative of it [m/s], [m/s^2]
    clock_m           (n,) as broadcast: to be added to a pseudorange, relativity and group delay inside [m]
    clock_truth_m     (n,) as transmitted: clock_m less what no message tells, the system's offset [m]
    clock_drift_mps   (n,) rate of both [m/s]
    available, healthy, frequency, iod, ura, ephemeris   (n,) see Broadcast
    """

    index: NDArray[np.int64]
    pos_ecef_m: Array
    vel_ecef_mps: Array
    acc_ecef_mps2: Array
    clock_m: Array
    clock_truth_m: Array
    clock_drift_mps: Array
    available: NDArray[np.bool_]
    healthy: NDArray[np.bool_]
    frequency: NDArray[np.int64]
    iod: NDArray[np.int64]
    ura: NDArray[np.int64]
    ephemeris: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class _Chunk:
    """coefficients (s, degree + 1, 4 n): positions by satellite and axis, then clocks."""

    coefficients: Array
    broadcast: Broadcast


class Sky:
    """Several constellations as one table.

    offset_m  (n,) residual offset of each satellite's system against GPS [m]: it lengthens the
              pseudoranges of the system's satellites and appears in no broadcast clock
    """

    def __init__(self, constellations: Sequence[Constellation], offset_m: Sequence[float]):
        self._constellations = tuple(constellations)
        self.index = np.concatenate([c.index for c in constellations])
        self._offset_m = np.concatenate(
            [np.full(len(c.index), value) for c, value in zip(constellations, offset_m, strict=True)]
        )
        self._chunks = Chunks(self._build)

    def at(self, t_ns: int) -> SkyState:
        """The sky at GPS time t_ns."""
        n = len(self.index)
        segment = GRID.segment(t_ns)
        number, row = divmod(segment, GRID.per_chunk)
        chunk = self._chunks[number]
        value, rate, acceleration = GRID.evaluate(chunk.coefficients[row], segment, t_ns)
        b = chunk.broadcast
        return SkyState(
            self.index,
            value[: 3 * n].reshape(n, 3),
            rate[: 3 * n].reshape(n, 3),
            acceleration[: 3 * n].reshape(n, 3),
            value[3 * n :],
            value[3 * n :] - self._offset_m,
            rate[3 * n :],
            b.available[row],
            b.healthy[row],
            b.frequency[row],
            b.iod[row],
            b.ura[row],
            b.ephemeris[row],
        )

    def _build(self, number: int) -> _Chunk:
        middles_ns, nodes_s = GRID.middles_ns(number), GRID.nodes_s
        parts = [c.sample(middles_ns, nodes_s) for c in self._constellations]
        positions = np.concatenate([pos for pos, _, _ in parts], axis=2)
        clocks = np.concatenate([clock for _, clock, _ in parts], axis=2)
        values = np.concatenate((positions.reshape(*positions.shape[:2], -1), clocks), axis=2)
        said = [b for _, _, b in parts]
        broadcast = Broadcast(
            *(np.concatenate([getattr(b, name) for b in said], axis=1) for name in Broadcast.__slots__)
        )
        return _Chunk(GRID.fit(values), broadcast)


NOMINAL: dict[str, Callable[[int], Constellation]] = {"gps": nominal_gps, "glonass": nominal_glonass}
"""System -> maker of its nominal constellation from the start of the run [ns]."""


def build_sky(sky: scenario.Sky, time: scenario.Time, resolve_path: Callable[[str], Path]) -> Sky:
    """The sky a scenario describes; ScenarioError with one line if it cannot be had.

    resolve_path  name of a navigation file as the scenario writes it -> the file
    """
    sources = {"gps": sky.gps, "glonass": sky.glonass}
    offset_m = {"gps": 0.0, "glonass": sky.glonass_offset_ns * 1e-9 * LIGHT_MPS}
    parts = {}
    for system, source in sources.items():
        if source == "nominal":
            parts[system] = NOMINAL[system](time.start_ns)
        elif source != "none":
            names = [source] if isinstance(source, str) else source
            parts[system] = from_files(system, [resolve_path(name) for name in names], time)
    if not parts:
        raise scenario.ScenarioError("sky: gps and glonass are both 'none'; nothing is left to receive")
    return Sky(list(parts.values()), [offset_m[system] for system in parts])
