"""Which of a file's columns hold the observables of a signal, satellite by satellite.

What a header announces says little: codes stand there that a system, or a satellite of an older kind, never
sends. So a satellite's own rows decide: of a signal's names the first that has nearly as many values as the
fullest. Where a code has no phase of its own, any phase of its carrier serves: codes of one carrier have one
phase but for constants of a quarter of a cycle or less (RINEX 3.05, 5.2 and table A23). For the rate alone
the phase of another carrier does as well: what the ionosphere makes of the two differs by some millimetres a
second.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.files.rinex_obs import Observations
from gnss_hil.emulator.receivers.recorded.signals import Signal, band_of, carriers

NEARLY = 0.9
"""A name with this share of the fullest one's values is as good as that: the order of names decides."""


@dataclass(frozen=True, slots=True, eq=False)
class Phase:
    """A carrier's phase in rows (p,).

    cycles, lli   nan and 0 where there is none
    band          of RINEX, by which the carrier is known
    """

    cycles: F64
    lli: I64
    band: str


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Observables of a signal in rows (p,) as written, nan where there is none.

    phase    of the signal's own carrier;  others   of the satellites' other carriers
    doppler  of the signal's own carrier [Hz];  strength   of the signal
    """

    phase: Phase
    others: tuple[Phase, ...]
    doppler: F64
    strength: F64


def ranges(file: Observations, signal: Signal) -> tuple[F64, I64]:
    """Pseudoranges (p,) of a signal in all rows of a file, and the row of `signal.codes` they are of; nan and
    -1 where there is none."""
    range_m, which = np.full(len(file.sat), np.nan), np.full(len(file.sat), -1)
    mine = satellites.system_of(file.sat) == signal.system
    names = [codes.range for codes in signal.codes]
    for sat in np.unique(file.sat[mine]).tolist():
        rows = np.flatnonzero(file.sat == sat)
        chosen = _fullest(
            names, {name: _positive(file.obs[name][rows]) for name in names if name in file.obs}
        )
        if chosen is not None:
            range_m[rows], which[rows] = file.obs[chosen][rows], names.index(chosen)
    there = _positive(range_m)
    return np.where(there, range_m, np.nan), np.where(there, which, -1)


def there(file: Observations, signal: Signal) -> Bool:
    """(p,) whether a row of a file has a pseudorange of a signal."""
    return ranges(file, signal)[1] >= 0


def columns(file: Observations, signal: Signal, which: I64, rows: I64) -> Columns:
    """What else rows (p,) of a file have of a signal, whose ranges are of `signal.codes[which]` (p,)."""
    own, other_bands = signal.band, [band for band in carriers(signal.system) if band != signal.band]
    phase = _empty(own, len(rows))
    others = [_empty(band, len(rows)) for band in other_bands]
    doppler, strength = (np.full(len(rows), np.nan) for _ in range(2))
    for sat in np.unique(file.sat[rows]).tolist():
        at = np.flatnonzero(file.sat[rows] == sat)
        codes, here = signal.codes[int(which[at[0]])], rows[at]
        _put(phase, file, _of_band("L", codes.phase, own, file.obs), here, at)
        for other in others:
            _put(other, file, _of_band("L", (), other.band, file.obs), here, at)
        doppler[at] = _values(file, _of_band("D", codes.doppler, own, file.obs), here)
        strength[at] = _values(file, codes.strength, here)
    return Columns(phase, tuple(others), doppler, strength)


def _positive(range_m: F64) -> Bool:
    return np.isfinite(range_m) & (range_m > 0)


def _empty(band: str, p: int) -> Phase:
    return Phase(np.full(p, np.nan), np.zeros(p, np.int64), band)


def _of_band(kind: str, first: Sequence[str], band: str, names: Iterable[str]) -> list[str]:
    """A file's names of one kind and band, `first` before the others."""
    return list(dict.fromkeys((*first, *(n for n in names if n[:1] == kind and band_of(n) == band))))


def _fullest(names: Sequence[str], filled: dict[str, Bool]) -> str | None:
    """The first of the names that has nearly as many values as any; None where none has any."""
    counts = {name: int(np.count_nonzero(filled[name])) for name in names if name in filled}
    most = max(counts.values(), default=0)
    return next((name for name, count in counts.items() if most and count >= NEARLY * most), None)


def _chosen(file: Observations, names: Sequence[str], rows: I64) -> str | None:
    return _fullest(names, {name: np.isfinite(file.obs[name][rows]) for name in names if name in file.obs})


def _values(file: Observations, names: Sequence[str], rows: I64) -> F64:
    name = _chosen(file, names, rows)
    return file.obs[name][rows] if name else np.full(len(rows), np.nan)


def _put(phase: Phase, file: Observations, names: Sequence[str], rows: I64, at: I64) -> None:
    """Fill in a phase at `at` of what one satellite's rows have."""
    name = _chosen(file, names, rows)
    if name is not None:
        phase.cycles[at] = file.obs[name][rows]
        phase.lli[at] = file.lli[name][rows] if name in file.lli else 0
