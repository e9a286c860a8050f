"""SP3-c files: orbits of the craft, and of the satellites above them.

An epoch without a position has zeros, as the format wants them. The craft are L01, L02, ... in the order of
the scenario, with velocities and without clocks: what SP3 means by a clock is a transmitting satellite's.
Source: S. Hilla, The Extended Standard Product 3 Orbit Format (SP3-c), 2010
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.export.time_series import TimeSeries

_NO_CLOCK = 999_999.999999
_MOST, _A_LINE = 85, 17
_MJD_OF_GPS_EPOCH = 44_244

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Orbits:
    """What a file holds; nan where something is missing.

    kind         "L" craft, "G", "R" or "M" for satellites of one or more systems
    names        n objects: G07, L01
    t_ns         (t,) GPS time, evenly spaced [ns]
    position_m   (t, n, 3) ECEF;  velocity_mps (t, n, 3) or None;  clock_s (t, n) or None
    comments     lines of at most 57 characters
    """

    kind: str
    names: tuple[str, ...]
    t_ns: NDArray[np.int64]
    position_m: Array
    velocity_mps: Array | None
    clock_s: Array | None
    comments: tuple[str, ...]


def of_craft(series: Sequence[TimeSeries]) -> Orbits:
    """Several craft on one grid of instants; Mistake if their epochs make none."""
    t_ns = _grid(series)
    state = np.full((len(t_ns), len(series), 6), np.nan)
    for n, one in enumerate(series):
        both = np.concatenate((one.position_m, one.velocity_mps), axis=1)
        state[np.searchsorted(t_ns, one.t_ns), n] = both
    names = tuple(f"L{n:02d}" for n in range(1, len(series) + 1))
    comments = tuple(f"{name} is {c.name}: {c.source}" for name, c in zip(names, series, strict=True))
    return Orbits("L", names, t_ns, state[..., :3], state[..., 3:], None, comments)


def _grid(series: Sequence[TimeSeries]) -> NDArray[np.int64]:
    """Instants (t,) that hold all epochs of the series, evenly spaced [ns]."""
    t_ns = np.unique(np.concatenate([one.t_ns for one in series]))
    if not len(t_ns):
        raise Mistake("no craft has a position; there is nothing to write")
    steps = np.diff(t_ns)
    step_ns = int(steps.min()) if len(steps) else gpstime.NS_PER_S
    if (steps % step_ns).any():
        raise Mistake(f"epochs are not evenly spaced ({step_ns / 1e9:g} s and others); SP3 wants a grid")
    return np.arange(t_ns[0], t_ns[-1] + 1, step_ns)


def text_of(orbits: Orbits) -> Iterator[str]:
    """The file, piece by piece; Mistake if it has too many objects."""
    yield from _header(orbits)
    shape = orbits.position_m.shape[:2]
    clock_us = np.full(shape, _NO_CLOCK) if orbits.clock_s is None else orbits.clock_s * 1e6
    rows = [("P", np.nan_to_num(orbits.position_m / 1e3), np.nan_to_num(clock_us, nan=_NO_CLOCK))]
    if orbits.velocity_mps is not None:
        rows.append(("V", np.nan_to_num(orbits.velocity_mps * 10), np.full(shape, _NO_CLOCK)))
    tables = [(letter, np.dstack((vectors, scalars)).tolist()) for letter, vectors, scalars in rows]
    for i, t in enumerate(orbits.t_ns.tolist()):
        yield f"*  {_moment(t)}\n"
        for n, name in enumerate(orbits.names):
            for letter, table in tables:
                x, y, z, clock = table[i][n]
                yield f"{letter}{name}{x:14.6f}{y:14.6f}{z:14.6f}{clock:14.6f}\n"
    yield "EOF\n"


def _moment(t_ns: int) -> str:
    m = gpstime.to_calendar(t_ns)
    seconds = m.second + t_ns % gpstime.NS_PER_S / 1e9
    return f"{m.year:4d} {m.month:2d} {m.day:2d} {m.hour:2d} {m.minute:2d} {seconds:11.8f}"


def _header(orbits: Orbits) -> Iterator[str]:
    count, first = len(orbits.names), int(orbits.t_ns[0])
    if count > _MOST:
        raise Mistake(f"{count} objects; an SP3-c file has room for {_MOST}")
    week, second, ns = gpstime.week_second_ns(first)
    days, rest_ns = divmod(first, 86_400 * gpstime.NS_PER_S)
    step_s = (int(orbits.t_ns[1]) - first) / 1e9 if len(orbits.t_ns) > 1 else 1.0
    flag = "P" if orbits.velocity_mps is None else "V"
    yield f"#c{flag}{_moment(first)} {len(orbits.t_ns):7d} ORBIT WGS84 FIT GHIL\n"
    yield f"## {week:4d} {second + ns / 1e9:15.8f} {step_s:14.8f} "
    yield f"{_MJD_OF_GPS_EPOCH + days:5d} {rest_ns / 86_400e9:15.13f}\n"
    names = [*orbits.names, *["  0"] * (_MOST - count)]
    for at in range(0, _MOST, _A_LINE):
        yield f"+  {f'{count:3d}' if at == 0 else '   '}   {''.join(names[at : at + _A_LINE])}\n"
    yield ("++       " + "  0" * _A_LINE + "\n") * 5
    yield f"%c {orbits.kind}  cc GPS ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n"
    yield "%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n"
    yield "%f  0.0000000  0.000000000  0.00000000000  0.000000000000000\n" * 2
    yield "%i    0    0    0    0      0      0      0      0         0\n" * 2
    for line in (*orbits.comments, *[""] * (4 - len(orbits.comments))):
        yield f"/* {line:<57.57}\n"
