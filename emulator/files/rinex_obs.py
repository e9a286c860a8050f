"""RINEX observation files, versions 2 to 4, as flat arrays: one row for each satellite and epoch.

Strict: what does not fit the format is refused with file, line and field. Satellites of systems the bench
does not know are passed over and counted; records of events are passed over.
Sources: RINEX 2.11 (Gurtner & Estey, 2007), tables A1, A2; RINEX 2.20 (Gurtner & Estey, 2001: spaceborne
receivers); RINEX 3.05 (IGS/RTCM, 2020), tables A2, A3
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites, systems
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.files.columns import Lines, decimals, flags, nothing_but_nines
from gnss_hil.emulator.files.rinex_epochs import EPOCHS, Epochs
from gnss_hil.emulator.files.rinex_obs_header import Header, parse_header
from gnss_hil.emulator.files.text import FileError, read_text

_FIELD, _DECIMALS = 14, 3
"""An observation is F14.3; loss of lock and strength, a digit each, follow."""

_SLOT = _FIELD + 2


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Observations of one receiver; p rows in file order, which is that of epochs.

    origin   the file
    header   what it says of itself
    t_ns     (e,) epoch tags: what the receiver's clock showed, on the GPS scale [ns]; they ascend
    clock_s  (e,) the receiver's clock offset by the file, nan where it has none [s]
    epoch    (p,) row of t_ns
    sat      (p,) satellite index
    obs      code -> (p,) value as written (m, cycles, Hz, ...), nan where there is none: blank, or 0.0,
             which is how RINEX writes it too (2.11, table A2; 3.05, table A3), or nines alone, five and more
    repeated code -> values left out, since SAME satellites or more of an epoch have the very same one
    passed   letter of a system that the bench has no name for -> rows of t_ns, one for each of its satellites
    lli      code -> (p,) loss of lock indicator, 0 where blank: bit 0 lock lost, bit 1 half cycles,
             bit 2 antispoofing (version 2) or BOC tracking (version 3)
    """

    origin: str
    header: Header
    t_ns: I64
    clock_s: F64
    epoch: I64
    sat: I64
    obs: dict[str, F64]
    lli: dict[str, I64]
    passed: dict[str, I64]
    repeated: dict[str, int] = field(default_factory=dict)


def read(path: Path) -> Observations:
    """The observations of a file, plain, gzip or compact RINEX; FileError with one line if it has faults."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> Observations:
    """The observations in the text of a file; `origin` names it in errors."""
    lines = Lines(text, origin)
    header, start = parse_header(lines.text, origin)
    epochs = EPOCHS[int(header.version) > 2](lines, header, start)
    if not len(epochs.t_ns):
        raise FileError(f"{origin}: line {len(lines.text)}: no observation follows the header")
    p = len(epochs.sat)
    codes = list(dict.fromkeys(code for of_system in header.codes.values() for code in of_system))
    obs = {code: np.full(p, np.nan) for code in codes}
    lli = {code: np.zeros(p, np.int64) for code in codes}
    for letter, of_system in header.codes.items():
        rows = _rows_of(letter, epochs.sat)
        for k, code in enumerate(of_system):
            values, lost = _column(lines, epochs, rows, k, code)
            obs[code][rows] = np.where(_is_none(values), np.nan, values) / header.scale_factors.get(
                (letter, code), 1.0
            )
            lli[code][rows] = lost
    counts = {code: _leave_out(obs[code], epochs.epoch) for code in codes if code[0] in _MEASURED}
    repeated = {code: count for code, count in counts.items() if count}
    return Observations(
        origin,
        header,
        epochs.t_ns,
        epochs.clock_s,
        epochs.epoch,
        epochs.sat,
        obs,
        lli,
        epochs.passed,
        repeated,
    )


SAME = 3
"""Satellites of an epoch that never have the same range, phase or Doppler to a millimetre or a millihertz."""

_MEASURED = "CPLD"


def _leave_out(values: F64, epoch: I64) -> int:
    """Make values (p,) nan that SAME rows of an epoch (p,) share, which stand for none; how many."""
    twins = np.flatnonzero((values[1:] == values[:-1]) & (epoch[1:] == epoch[:-1]))
    suspects = np.flatnonzero(np.isin(values, np.unique(values[twins]))) if len(twins) else twins
    if not len(suspects):
        return 0
    pairs = np.stack((epoch[suspects].astype(np.float64), values[suspects]))
    _, which, count = np.unique(pairs, axis=1, return_inverse=True, return_counts=True)
    shared = suspects[count[which.ravel()] >= SAME]
    values[shared] = np.nan
    return len(shared)


def _is_none(values: F64) -> Bool:
    """Whether values as written stand for none: 0.0, or nothing but nines, which some programs write."""
    return (values == 0) | nothing_but_nines(values, range(5, 11), _DECIMALS)


def _rows_of(letter: str, sat: I64) -> I64:
    """Rows that a list of codes is for; version 2 has one list for all."""
    if not letter:
        return np.arange(len(sat))
    system = systems.by_letter(letter)
    if system is None:
        return np.zeros(0, np.int64)
    return np.flatnonzero(satellites.system_of(sat) == system.value)


def _column(lines: Lines, epochs: Epochs, rows, k: int, code: str) -> tuple[NDArray, NDArray]:
    """Values and loss of lock of the k-th observation of some rows."""
    down, across = divmod(k, epochs.per_line)
    at = epochs.line[rows] + down
    place = epochs.indent + across * _SLOT
    values, bad = decimals(lines.field(at, place, _FIELD), _DECIMALS)
    _refuse(lines, at, place, _FIELD, bad, code, f"allowed is F{_FIELD}.{_DECIMALS} or blank")
    lost, bad = flags(lines.field(at, place + _FIELD, 1))
    _refuse(lines, at, place + _FIELD, 1, bad, f"loss of lock of {code}", "allowed is a digit or blank")
    return values, lost


def _refuse(lines: Lines, at, place: int, width: int, bad: Bool, name: str, allowed: str) -> None:
    if bad.any():
        line = int(at[np.argmax(bad)])
        found = lines.text[line][place : place + width]
        raise FileError(f"{lines.origin}: line {line + 1}: {name} is '{found}'; {allowed}")
