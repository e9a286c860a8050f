"""The navigation satellites above: where they are, what their clocks show, what they broadcast.

A sky is made of constellations, one for each system. A constellation evaluates its ephemerides for many
segments at once; the sky keeps the result as polynomials, one minute each, and reads them every epoch.

Truth and report. Left alone, what satellites broadcast *is* the truth (modelled: no satellite flies it).
Where one ephemeris gives way to the next, such a satellite jumps by what the two disagree, decimetres to
metres, and shows it by another `ephemeris` number: a receiver cannot count cycles across that. With precise
orbits the truth is theirs, and what satellites broadcast is only what receivers decode of it; error models
change the report, never the truth. The table holds the truth and what the report is off.

Step 1 of RU 2706636 C1: satellites with known orbits transmit at known times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.config.tables import ScenarioError, Tell, Time, untold
from gnss_hil.emulator.constellation import presence
from gnss_hil.emulator.constellation.base import (
    EXACT,
    NO_ACCURACY,
    PRECISE,
    Broadcast,
    Constellation,
    ReportErrors,
)
from gnss_hil.emulator.constellation.precise_sky import PreciseConstellation, of_two_frequencies_m
from gnss_hil.emulator.constellation.sources import from_files, nominal, precise_orbits
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.numerics.chebyshev import NS_PER_S, Chunks, Grid

GRID = Grid(origin_ns=0, segment_ns=60 * NS_PER_S, margin_ns=2 * NS_PER_S, degree=7, per_chunk=30)
"""Ephemerides change on whole minutes of GPS time; 2 s beyond a segment still belong to its polynomial."""


@dataclass(frozen=True, slots=True, eq=False)
class SkyState:
    """All satellites of a sky at one instant, or (an axis before) at several; rows are the same satellites
    through a run.

    index               (n,) satellite index, `gnss_hil.dbc.common.satellites`
    pos_ecef_m          (n, 3) antenna phase centre, WGS-84 ECEF axes of the instant [m]
    vel_ecef_mps        (n, 3) first and
    acc_ecef_mps2       (n, 3) second time derivative of it [m/s], [m/s^2]
    clock_truth_m       (n,) to be added to a pseudorange, relativity and group delay inside, as transmitted:
                        less the system's offset, which is in no message [m]; its rate:
    clock_truth_mps     (n,) [m/s]
    clock_m, clock_drift_mps     (n,) the same as reported, without the system's offset
    off_ecef_m, off_ecef_mps     (n, 3) reported minus true position, and its rate; None if they are one
    broadcast           (n,) each: what the satellites broadcast
    """

    index: I64
    pos_ecef_m: F64
    vel_ecef_mps: F64
    acc_ecef_mps2: F64
    clock_truth_m: F64
    clock_truth_mps: F64
    clock_m: F64
    clock_drift_mps: F64
    off_ecef_m: F64 | None
    off_ecef_mps: F64 | None
    broadcast: Broadcast


class TrueOrbits(Protocol):
    """Orbits and clocks that are the truth instead of what is broadcast; `Constellation.sample` without a
    message: positions (s, k, n, 3), clocks (s, k, n), available (s, n). Numbers are nan or without meaning
    where nothing is available."""

    @property
    def index(self) -> I64: ...

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, NDArray]: ...


@dataclass(frozen=True, slots=True, eq=False)
class _Chunk:
    """coefficients (s, degree + 1, 4 n or 8 n): positions by satellite and axis, clocks; then, where they
    differ, what the report is off, in the same order."""

    coefficients: F64
    broadcast: Broadcast


class Sky:
    """Several constellations as one table.

    index       (n,) satellite index;  messages (n,) whether it is known what a satellite broadcasts, which of
                precise orbits it is not
    offset_m    (n,) residual offset of each satellite's system against GPS [m]: it lengthens the
                pseudoranges of the system's satellites and appears in no broadcast clock
    truth       orbits that are flown instead of those broadcast; satellites they lack are not there
    truthful      satellites report the truth, errors of the report apart, instead of what they broadcast
    report_errors  errors of the report
    emulated      nothing but what is built here is received: where satellites report the truth itself, they
                  promise it
    """

    def __init__(
        self,
        constellations: Sequence[Constellation],
        offset_m: Sequence[float],
        truth: TrueOrbits | None = None,
        report_errors: Sequence[ReportErrors] = (),
        truthful: bool = False,
        emulated: bool = True,
    ):
        self._constellations = tuple(constellations)
        self.index = np.concatenate([c.index for c in constellations])
        self.messages = np.concatenate(
            [np.full(len(c.index), not isinstance(c, PreciseConstellation)) for c in constellations]
        )
        self._offset_m = np.concatenate(
            [np.full(len(c.index), value) for c, value in zip(constellations, offset_m, strict=True)]
        )
        self._truth = truth
        self._report_errors = tuple(report_errors)
        self._truthful = truthful
        self._exact = emulated and not report_errors and (truth is None or truthful)
        self._chunks = Chunks(self._build)

    def at(self, t_ns: int) -> SkyState:
        """The sky at GPS time t_ns."""
        segment = GRID.segment(t_ns)
        number, row = divmod(segment, GRID.per_chunk)
        chunk = self._chunks[number]
        values = GRID.evaluate(chunk.coefficients[row], segment, t_ns)
        return self._state(
            values, Broadcast(*(getattr(chunk.broadcast, name)[row] for name in Broadcast.__slots__))
        )

    def over(self, t_ns: I64) -> SkyState:
        """The sky at GPS times (q,), ascending: every field but `index` has an axis of times before its
        own."""
        segments, place = np.unique(GRID.segment(t_ns), return_inverse=True)
        where = [divmod(segment, GRID.per_chunk) for segment in segments.tolist()]
        rows = [(self._chunks[number].broadcast, row) for number, row in where]
        values = GRID.evaluate_many(self._coefficients, t_ns)
        names = Broadcast.__slots__
        return self._state(
            values.swapaxes(0, 1),
            Broadcast(*(np.stack([getattr(b, name)[row] for b, row in rows])[place] for name in names)),
        )

    def _coefficients(self, segment: int) -> F64:
        number, row = divmod(segment, GRID.per_chunk)
        return self._chunks[number].coefficients[row]

    def _state(self, values: F64, broadcast: Broadcast) -> SkyState:
        """The state of values and two derivatives (3, ..., 4 n or 8 n)."""
        n = len(self.index)
        value, rate, acceleration = values
        shape = *value.shape[:-1], n, 3
        clock_m, drift_mps = value[..., 3 * n : 4 * n], rate[..., 3 * n : 4 * n]
        reported_m, reported_mps, off, off_rate = clock_m, drift_mps, None, None
        if value.shape[-1] > 4 * n:
            reported_m, reported_mps = clock_m + value[..., 7 * n :], drift_mps + rate[..., 7 * n :]
            off = value[..., 4 * n : 7 * n].reshape(shape)
            off_rate = rate[..., 4 * n : 7 * n].reshape(shape)
        return SkyState(
            index=self.index,
            pos_ecef_m=value[..., : 3 * n].reshape(shape),
            vel_ecef_mps=rate[..., : 3 * n].reshape(shape),
            acc_ecef_mps2=acceleration[..., : 3 * n].reshape(shape),
            clock_truth_m=clock_m - self._offset_m,
            clock_truth_mps=drift_mps,
            clock_m=reported_m,
            clock_drift_mps=reported_mps,
            off_ecef_m=off,
            off_ecef_mps=off_rate,
            broadcast=broadcast,
        )

    def _build(self, number: int) -> _Chunk:
        middles_ns, nodes_s = GRID.middles_ns(number), GRID.nodes_s
        parts = [c.sample(middles_ns, nodes_s) for c in self._constellations]
        positions = np.concatenate([pos for pos, _, _ in parts], axis=2)
        clocks = np.concatenate([clock for _, clock, _ in parts], axis=2)
        of_each = [b for _, _, b in parts]
        broadcast = Broadcast(
            *(np.concatenate([getattr(b, name) for b in of_each], axis=1) for name in Broadcast.__slots__)
        )
        columns = _columns(positions, clocks)
        if self._truth is not None:
            broadcast, columns = self._flown(self._truth, middles_ns, nodes_s, positions, clocks, broadcast)
        if self._report_errors:
            columns = self._misreported(middles_ns, nodes_s, columns)
        if self._exact:
            promised = np.where(broadcast.ura == NO_ACCURACY, NO_ACCURACY, EXACT)
            broadcast = replace(broadcast, ura=promised)
        return _Chunk(GRID.fit(columns), broadcast)

    def _flown(
        self, truth: TrueOrbits, middles_ns, nodes_s, positions, clocks, broadcast
    ) -> tuple[Broadcast, F64]:
        """Broadcast and columns of a sky that flies `truth` and reports that or what it broadcasts.

        A truth without jumps needs no number of its ephemeris: one for all.
        """
        flown_m, flown_clock_m, flies = truth.sample(middles_ns, nodes_s)
        place = {index: column for column, index in enumerate(truth.index.tolist())}
        column = np.array([place.get(index, -1) for index in self.index.tolist()])
        there = (column >= 0) & flies[:, column] & broadcast.available
        true_m = np.where(there[:, None, :, None], flown_m[:, :, column], positions)
        # Precise clocks are those of ionosphere-free ranges; what is transmitted on L1 has its group delay.
        on_l1_m = flown_clock_m[:, :, column] - of_two_frequencies_m(self.index, broadcast)[:, None]
        true_clock_m = np.where(there[:, None], on_l1_m, clocks)
        broadcast = replace(broadcast, available=there, ephemeris=np.zeros_like(broadcast.ephemeris))
        true = _columns(true_m, true_clock_m)
        if self._truthful:
            ura = np.where(broadcast.ura == NO_ACCURACY, NO_ACCURACY, PRECISE)
            return replace(broadcast, ura=ura), true
        return broadcast, np.concatenate((true, _columns(positions, clocks) - true), axis=2)

    def _misreported(self, middles_ns, nodes_s, columns: F64) -> F64:
        """Columns with the errors of the report added to what it is off."""
        s, k, width = columns.shape
        n = len(self.index)
        rates = GRID.derivative(columns[:, :, : 3 * n])
        pos_m, vel_mps = (part.reshape(s, k, n, 3) for part in (columns[:, :, : 3 * n], rates))
        off = columns[:, :, 4 * n :] if width > 4 * n else np.zeros((s, k, 4 * n))
        for errors in self._report_errors:
            off_m, off_clock_m = errors(middles_ns, nodes_s, pos_m, vel_mps)
            off = off + _columns(
                np.broadcast_to(off_m, (s, k, n, 3)), np.broadcast_to(off_clock_m, (s, k, n))
            )
        return np.concatenate((columns[:, :, : 4 * n], off), axis=2)


def _columns(positions: F64, clocks: F64) -> F64:
    """Positions (s, k, n, 3) and clocks (s, k, n) side by side, (s, k, 4 n)."""
    return np.concatenate((positions.reshape(*positions.shape[:2], -1), clocks), axis=2)


class Sources(Protocol):
    """Where a sky comes from, by a scenario."""

    @property
    def orbits(self) -> tuple[str, ...]: ...
    @property
    def reports(self) -> str: ...

    def sources(self) -> dict[str, str | list[str]]:
        """Source of each system's satellites, by its name."""
        ...

    def offset_ns(self, system: str) -> float: ...


def build_sky(
    sky: Sources,
    time: Time,
    resolve_path: Callable[[str], Path],
    report_errors: Callable[[I64], Sequence[ReportErrors]] = lambda index: (),
    tell: Tell = untold,
    emulated: bool = True,
) -> Sky:
    """The sky a scenario describes; ScenarioError with one line if it cannot be had.

    resolve_path  name of a navigation file as the scenario writes it -> the file
    report_errors    satellite index (n,) -> errors of what these satellites report
    tell          takes remarks
    emulated      see `Sky`
    """
    parts: dict[str, Constellation] = {}
    for system, source in sky.sources().items():
        if source == "nominal":
            parts[system] = nominal(system, time.start_ns)
        elif source != "none":
            names = [source] if isinstance(source, str) else source
            parts[system] = from_files(system, [resolve_path(name) for name in names], time, tell)
    truth = None
    if sky.orbits:
        truth = precise_orbits("sky.orbits", [resolve_path(name) for name in sky.orbits], time, tell)
    if not parts:
        names = list(sky.sources())
        every = "both" if len(names) == 2 else "all"
        raise ScenarioError(f"sky: {' and '.join(names)} are {every} 'none'; nothing is left to receive")
    for system, part in parts.items():
        if truth is not None or sky.sources()[system] != "nominal":
            for remark in _missing(part, truth, time):
                tell(f"sky.{system}: {remark}")
    constellations = list(parts.values())
    index = np.concatenate([part.index for part in constellations])
    offsets_m = [sky.offset_ns(system) * 1e-9 * LIGHT_MPS for system in parts]
    return Sky(constellations, offsets_m, truth, report_errors(index), sky.reports == "orbits", emulated)


def _missing(part: Constellation, truth: TrueOrbits | None, time: Time) -> Iterator[str]:
    """What is missing of a system's satellites in a run, a line each."""
    middles_ns, middle_s = presence.minutes_ns(*time.span_ns), np.zeros(1)
    broadcast = part.sample(middles_ns, middle_s)[2]
    there = broadcast.available
    if truth is not None:
        flies = np.zeros((len(middles_ns), satellites.SATELLITES), bool)
        flies[:, truth.index] = truth.sample(middles_ns, middle_s)[2]
        there = there & flies[:, part.index]
    yield from presence.remarks(part.index, there, middles_ns, broadcast.healthy)
