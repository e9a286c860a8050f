"""Observations of a file as what channels track: one row for each satellite, signal and epoch.

A satellite's signal keeps a channel from its first observation to a gap. Within such an arc, cut again where
the receiver reports a loss of lock, the carrier phase counts cycles, and a spline through it, or through that
of another carrier of the satellite, gives the range rate where the file has no Doppler.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np

from gnss_hil.dbc.common import satellites, systems
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.config.tables import ScenarioError
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.files.rinex_obs import Observations
from gnss_hil.emulator.receivers.recorded import observables
from gnss_hil.emulator.receivers.recorded.signals import Signal, carriers

SPLINE_DEGREE = 5
ENOUGH = 4
"""Points of an arc from which on its rates are good to centimetres a second at ten seconds: three leave
0.3 m/s, two 40 m/s."""

LOST_LOCK = 1
"""Bit 0 of a loss of lock indicator. RINEX 2.11, table A2."""

HALF_CYCLE = 2
"""Bit 1: half a cycle is in doubt. RINEX 3.05, 5.4; version 2 flags it by the other wavelength factor."""

LOUDEST_DBHZ = 64.0
"""No receiver of navigation signals sees more: strengths beyond it are ratios of voltages, not dBHz."""

SLIPS = 16


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Rows by epoch, then channel.

    epoch     (p,) 0-based;  channel (p,);  sat (p,) satellite index;  signal (p,) number of the contract
    carrier_hz   (p,) of the signal, GLONASS frequency inside
    range_m   (p,) pseudorange;  rate_mps (p,) its rate;  phase_cyc (p,) less an arc's first, nan where none
    slips     (p,) arcs of phase the channel has begun, modulo 16
    half_cycle   (p,) whether half a cycle of the phase is in doubt
    cn0_dbhz  (p,) nan where the file has no strength
    dropped   rows left out: no range rate could be had, or no channel was free
    doubtful  strengths left out: no receiver measures such
    """

    epoch: I64
    channel: I64
    sat: I64
    signal: I64
    carrier_hz: F64
    range_m: F64
    rate_mps: F64
    phase_cyc: F64
    slips: I64
    half_cycle: Bool
    cn0_dbhz: F64
    dropped: int
    doubtful: int

    def __len__(self) -> int:
        return len(self.sat)

    def __getitem__(self, rows) -> Tracks:
        names = (field.name for field in fields(self) if field.name not in ("dropped", "doubtful"))
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


@dataclass(frozen=True, slots=True, eq=False)
class _Raw:
    """One signal's rows in the order of satellite and epoch; names as in Tracks, arc (p,) by number."""

    epoch: I64
    sat: I64
    arc: I64
    carrier_hz: F64
    range_m: F64
    rate_mps: F64
    phase_cyc: F64
    half_cycle: Bool
    strength: F64


def tracks(
    file: Observations,
    signals: Sequence[Signal],
    epoch_of: I64,
    channels: int,
    frequencies: Mapping[int, int],
) -> Tracks:
    """Channels' rows of a file.

    signals   wanted, in the order in which channels are given to them
    epoch_of  (e,) number of the run's epoch for each of the file's, -1 for one that is left out
    frequencies   slot -> frequency number of GLONASS satellites; others are left out, and counted nowhere:
              nothing above is known of them
    Raises ScenarioError if no satellite of the signal's system has it under any of its names.
    """
    parts = [_raw(file, signal, epoch_of, frequencies) for signal in signals]
    raw = _Raw(*(np.concatenate([getattr(part, name) for part in parts]) for name in _Raw.__slots__))
    which = np.repeat(np.arange(len(parts)), [len(part.sat) for part in parts])
    channel, slips = _seated(raw.epoch, which, raw.sat, raw.arc, channels)
    keep = (channel >= 0) & np.isfinite(raw.rate_mps)
    order = np.lexsort((channel, raw.epoch))
    order = order[keep[order]]
    cn0_dbhz = decibels(raw.strength, file.header.strength_unit)

    return Tracks(
        epoch=raw.epoch[order],
        channel=channel[order],
        sat=raw.sat[order],
        signal=np.array([signal.number for signal in signals])[which[order]],
        carrier_hz=raw.carrier_hz[order],
        range_m=raw.range_m[order],
        rate_mps=raw.rate_mps[order],
        phase_cyc=raw.phase_cyc[order],
        slips=slips[order],
        half_cycle=raw.half_cycle[order],
        cn0_dbhz=cn0_dbhz[order],
        dropped=int(np.count_nonzero(~keep)),
        doubtful=int(np.count_nonzero(np.isfinite(raw.strength[keep]) & np.isnan(cn0_dbhz[keep]))),
    )


def _raw(file: Observations, signal: Signal, epoch_of: I64, frequencies: Mapping[int, int]) -> _Raw:
    range_m, which = observables.ranges(file, signal)
    here = which >= 0
    if not here.any():
        raise _absent(file, signal)
    here &= epoch_of[file.epoch] >= 0
    if signal.spacing_hz:
        here &= np.isin(satellites.number_of(file.sat), list(frequencies))
    rows = np.flatnonzero(here)
    rows = rows[np.lexsort((file.epoch[rows], file.sat[rows]))]
    epoch, sat = epoch_of[file.epoch[rows]], file.sat[rows]
    seen = observables.columns(file, signal, which[rows], rows)
    number = _frequencies(signal, sat, frequencies)
    carrier_hz = signal.carrier_hz + number * signal.spacing_hz
    t_s = (file.t_ns[file.epoch[rows]] - file.t_ns[0]) / NS_PER_S
    by_phase = [_counted(phase, signal, number, sat, epoch) for phase in (seen.phase, *seen.others)]
    by_spline = _best_rates(sat, epoch, t_s, by_phase, range_m[rows])
    found_mps = np.where(np.isfinite(seen.doppler), -seen.doppler * LIGHT_MPS / carrier_hz, by_spline)
    arc, cycles = by_phase[0][0], seen.phase.cycles
    cycles = cycles - _first_of_each(arc, cycles)
    half = (seen.phase.lli & HALF_CYCLE) > 0
    return _Raw(epoch, sat, arc, carrier_hz, range_m[rows], found_mps, cycles, half, seen.strength)


def _absent(file: Observations, signal: Signal) -> ScenarioError:
    names = ", ".join(codes.range for codes in signal.codes)
    rows = satellites.system_of(file.sat) == signal.system
    system = systems.by_value(signal.system)
    assert system is not None, "signals are of the table of systems"
    if not rows.any():
        return ScenarioError(
            f"{file.origin}: no {signal.name} pseudorange ({names}): no satellite of {system.name}"
        )
    has = ", ".join(name for name, values in file.obs.items() if np.isfinite(values[rows]).any()) or "nothing"
    return ScenarioError(
        f"{file.origin}: no {signal.name} pseudorange ({names}); of {system.name} it has {has}"
    )


def _counted(phase: observables.Phase, signal: Signal, number: F64, sat: I64, epoch: I64) -> tuple[I64, F64]:
    """Arcs (p,) of a phase of a signal's satellites, whose frequency numbers are `number` (p,), and the phase
    as a range [m]."""
    arc = arcs(sat, epoch, np.isfinite(phase.cycles), (phase.lli & LOST_LOCK) > 0)
    carrier = carriers(signal.system)[phase.band]
    return arc, phase.cycles * LIGHT_MPS / (carrier.carrier_hz + number * carrier.spacing_hz)


def _best_rates(sat: I64, epoch: I64, t_s: F64, by_phase: Sequence[tuple[I64, F64]], code_m: F64) -> F64:
    """Range rates (p,) [m/s] of the first of some phases whose arc is long enough, the signal's own before
    others; of the code, coarser, where no arc of phase is.

    by_phase  arcs (p,) and phases (p,) [m], nan where there is none
    The code has no slips: its arcs end at gaps alone. Where all are too short the first chord is left.
    """
    always = np.ones(len(sat), bool)
    out, chord = np.full(len(sat), np.nan), np.full(len(sat), np.nan)
    for arc, counted_m in (*by_phase, (arcs(sat, epoch, always, ~always), code_m)):
        if np.isfinite(out).all():
            break
        found = rates(arc, t_s, counted_m)
        chord = np.where(np.isfinite(chord), chord, found)
        out = np.where(np.isnan(out) & (_lengths(arc) >= ENOUGH), found, out)
    return np.where(np.isfinite(out), out, chord)


def _lengths(arc: I64) -> I64:
    """(p,) points of the arc that each row is in."""
    return np.bincount(arc)[arc] if len(arc) else arc


def _frequencies(signal: Signal, sat: I64, frequencies: Mapping[int, int]) -> F64:
    """Frequency numbers (p,) of a signal's satellites, 0 where all share one carrier."""
    if not signal.spacing_hz:
        return np.zeros(len(sat))
    return np.array([frequencies[number] for number in satellites.number_of(sat).tolist()], np.float64)


def arcs(sat: I64, epoch: I64, phased: Bool, lost: Bool) -> I64:
    """Numbers (p,) of the arcs in rows sorted by satellite and epoch. One ends where a satellite or a phase
    is missing for an epoch, and where lock was lost."""
    begins = np.ones(len(sat), bool)
    begins[1:] = (sat[1:] != sat[:-1]) | (epoch[1:] != epoch[:-1] + 1) | lost[1:]
    begins[1:] |= phased[1:] != phased[:-1]
    return np.cumsum(begins) - 1


def rates(arc: I64, t_s: F64, phase_cyc: F64) -> F64:
    """Rates (p,) per second by an interpolating spline through each arc; nan in arcs of one."""
    from scipy.interpolate import make_interp_spline

    out = np.full(len(arc), np.nan)
    for begin, end in _stretches(arc):
        if end - begin < 2 or not np.isfinite(phase_cyc[begin]):
            continue
        degree = min(SPLINE_DEGREE, end - begin - 1)
        t, cycles = t_s[begin:end], phase_cyc[begin:end]
        spline = make_interp_spline(t - t[0], cycles - cycles[0], degree)
        out[begin:end] = spline(t - t[0], 1)
    return out


def _stretches(values: I64) -> Iterator[tuple[int, int]]:
    """Begin and end of each stretch of equal values (p,), none of them negative."""
    bounds = np.append(np.flatnonzero(np.diff(values, prepend=-1)), len(values))
    return pairwise(bounds.tolist())


def _first_of_each(arc: I64, phase_cyc: F64) -> F64:
    """(p,) whole cycles of an arc's first phase: what its ambiguity takes off."""
    starts = np.flatnonzero(np.diff(arc, prepend=-1))
    return np.floor(phase_cyc[starts])[arc] if len(arc) else phase_cyc


def decibels(strength: F64, unit: str = "") -> F64:
    """C/N0 (p,) [dBHz] of signal strengths as written: dBHz, or voltage ratios in 1 Hz; nan where there is
    none, or none that a receiver measures.

    unit   SIGNAL STRENGTH UNIT of the header. Without one, values of which one in ten or more is beyond
           LOUDEST_DBHZ are ratios; each value counts once, however often a file writes it for "unknown".
    Source: RINEX 3.05, 5.7 (S in dBHz); GRACE's receivers report voltage ratios, 20 log10 of which is C/N0
    (JPL, GRACE Level 1B Data Product User Handbook, GPS1B)
    """
    known = np.unique(strength[np.isfinite(strength)])
    if len(known) and unit != "DBHZ" and np.quantile(known, 0.9) > LOUDEST_DBHZ:
        return np.where(strength > 1, 20 * np.log10(np.maximum(strength, 1.0)), np.nan)
    return np.where((strength > 0) & (strength <= LOUDEST_DBHZ), strength, np.nan)


def _seated(epoch: I64, which: I64, sat: I64, arc: I64, channels: int) -> tuple[I64, I64]:
    """Channel (p,) of each row, -1 where none was free, and slips (p,) modulo 16.

    A pair of satellite and signal keeps its channel while it is observed in every epoch; the lowest free one
    is given to who comes.
    """
    channel, slips = np.full(len(sat), -1), np.zeros(len(sat), np.int64)
    held: dict[tuple[int, int], tuple[int, int]] = {}
    begun = np.zeros(channels, np.int64)
    order = np.lexsort((which, sat, epoch))
    for begin, end in _stretches(epoch[order]):
        rows = order[begin:end].tolist()
        now = {(int(sat[row]), int(which[row])): row for row in rows}
        held = {pair: seat for pair, seat in held.items() if pair in now}
        free = sorted(set(range(channels)) - {place for place, _ in held.values()})
        for pair, row in now.items():
            if pair not in held:
                if not free:
                    continue
                held[pair] = free.pop(0), -1
            place, last = held[pair]
            begun[place] += last != arc[row]
            held[pair] = place, int(arc[row])
            channel[row], slips[row] = place, begun[place] % SLIPS
    return channel, slips
