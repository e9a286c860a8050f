"""RINEX 3 observation files.

Epochs are tagged with what the receiver's clock showed, in steps of 100 ns as the format and the bus both
have them: a tag minus pseudorange / c is the time of transmission by the very clock that measured. A tag of
GPS time would put satellites 1 m off for each 0.3 ms of clock.
Source: RINEX 3.04 (IGS/RTCM, 2018), 5 and tables 4, 5, A2, A3
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.tools.export.codes import Codes, codes_of
from gnss_hil.tools.export.rinex_systems import observation_lines, opening
from gnss_hil.tools.export.rinex_text import comments, instant, labelled, leap_seconds
from gnss_hil.tools.export.run_data import Array, CraftData, Rows

BLANK = " " * 16


@dataclass(frozen=True, slots=True)
class Observer:
    """The receiver and antenna of a header.

    receiver, antenna   names
    lever_body_m        (3,) antenna from the centre of mass, and boresight_body (3,), None if it has none
    """

    receiver: str
    antenna: str
    lever_body_m: tuple[float, ...]
    boresight_body: tuple[float, ...] | None
    comment: str


def text_of(data: CraftData, rows: Rows, observer: Observer) -> Iterator[str]:
    """The file of rows (sorted by epoch and satellite, none of them twice), piece by piece."""
    codes = codes_of(rows)
    tags_ns = data.tag_ns(rows.epoch, rows.receiver)
    yield _header(data, rows, codes, tags_ns, observer)
    line_of = np.cumsum(_begins(rows.epoch, rows.sat)) - 1
    lines = _lines(rows, codes, line_of)
    epoch_of_line = rows.epoch[_begins(rows.epoch, rows.sat)]
    starts = np.flatnonzero(_begins(epoch_of_line))
    tag_of_line = tags_ns[_begins(rows.epoch, rows.sat)]
    for first, end in zip(starts.tolist(), [*starts[1:].tolist(), len(lines)], strict=True):
        moment, seconds = instant(int(tag_of_line[first]))
        yield f"> {moment:%Y %m %d %H %M} {seconds}  0{end - first:3d}\n"
        yield "".join(lines[first:end])


def _begins(*columns: NDArray) -> NDArray[np.bool_]:
    """(k,) whether a row differs from the one before."""
    new = np.ones(len(columns[0]), bool)
    new[1:] = np.any([c[1:] != c[:-1] for c in columns], axis=0)
    return new


def _lines(rows: Rows, codes: Codes, line_of: NDArray[np.int64]) -> list[str]:
    """A line for each satellite and epoch."""
    lost = loss_of_lock(rows)
    strength = np.clip(rows.cn0_dbhz // 6, 1, 9).astype(int)
    flags = [(f"{b or ' '}{s}", f" {s}") for b, s in zip(lost.tolist(), strength.tolist(), strict=True)]
    doppler_hz = -rows.range_rate_mps / codes.wave_m
    cells = [
        f"{p:14.3f}{plain}{phase:14.3f}{flag}"
        + (f"{d:14.3f}  " if d == d else BLANK)
        + f"{s:14.3f}  "
        for p, phase, d, s, (flag, plain) in zip(
            rows.pseudorange_m.tolist(), rows.phase_cyc.tolist(), doppler_hz.tolist(),
            rows.cn0_dbhz.tolist(), flags, strict=True,
        )
    ]  # fmt: skip
    names = [satellites.name(i) for i in range(satellites.SATELLITES)]
    lines, last, width = [], -1, 0
    for line, sat, first, cell in zip(
        line_of.tolist(), rows.sat.tolist(), codes.first.tolist(), cells, strict=True
    ):
        if line != last:
            lines.append(names[sat])
            last, width = line, 0
        lines[-1] += BLANK * (first - width) + cell
        width = first + 4
    return [line.rstrip() + "\n" for line in lines]


def loss_of_lock(rows: Rows) -> NDArray[np.int64]:
    """(k,) LLI: bit 0 where the phase does not go on from the epoch before, bit 1 for a half-cycle doubt.

    A phase goes on if the same channel measured the same satellite in the epoch before with the same count of
    slips. The first of a satellite's phases has nothing to go on from and is no loss.
    """
    order = np.lexsort((rows.epoch, rows.signal, rows.sat))
    r = rows[order]
    same = np.zeros(len(r), bool)
    goes_on = np.zeros(len(r), bool)
    same[1:] = (r.sat[1:] == r.sat[:-1]) & (r.signal[1:] == r.signal[:-1])
    goes_on[1:] = r.epoch[1:] == r.epoch[:-1] + 1
    for column in (r.receiver, r.channel, r.slips):
        goes_on[1:] &= column[1:] == column[:-1]
    lost = np.empty(len(r), np.int64)
    lost[order] = same & ~goes_on
    return lost + 2 * rows.half_cycle


def _vector(values: tuple[float, ...] | Array) -> str:
    return "".join(f"{v:14.4f}" for v in values)


def _header(data: CraftData, rows: Rows, codes: Codes, tags_ns: NDArray[np.int64], observer: Observer) -> str:
    letters = "".join(codes.types)
    first, seconds = instant(int(tags_ns[0]))
    interval_s = np.median(np.diff(data.t_ns)) / gpstime.NS_PER_S if len(data.t_ns) > 1 else 0.0
    lines = [
        opening("OBSERVATION DATA", letters),
        comments(observer.comment),
        labelled(data.name, "MARKER NAME"),
        labelled("SPACEBORNE", "MARKER TYPE"),
        labelled(f"{'gnss-hil':<20}{'gnss-hil':<40}", "OBSERVER / AGENCY"),
        labelled(f"{'1':<20}{observer.receiver:<20.20}{'':20}", "REC # / TYPE / VERS"),
        labelled(f"{'1':<20}{observer.antenna:<20.20}", "ANT # / TYPE"),
        labelled(_vector((0, 0, 0)), "ANTENNA: DELTA H/E/N"),
        labelled(_vector(observer.lever_body_m), "ANTENNA: DELTA X/Y/Z"),
    ]
    if observer.boresight_body is not None:
        lines.append(labelled(_vector(observer.boresight_body), "ANTENNA: B.SIGHT XYZ"))
    lines.append(labelled(_vector((0, 0, 0)), "CENTER OF MASS: XYZ"))
    for letter, types in codes.types.items():
        # Thirteen codes a line; the bench knows two signals of a system at most three times over.
        for at in range(0, len(types), 13):
            count = f"{letter}  {len(types):3d}" if at == 0 else " " * 6
            lines.append(
                labelled(count + "".join(f" {t}" for t in types[at : at + 13]), "SYS / # / OBS TYPES")
            )
    lines += [
        labelled("DBHZ", "SIGNAL STRENGTH UNIT"),
        *([labelled(f"{interval_s:10.3f}", "INTERVAL")] if interval_s else []),
        labelled(f"{first.year:6d}{first.month:6d}{first.day:6d}{first.hour:6d}{first.minute:6d}"
                 f"   {seconds}     GPS", "TIME OF FIRST OBS"),
        labelled("     0", "RCV CLOCK OFFS APPL"),
        *(labelled(f"{letter} {types[i]}", "SYS / PHASE SHIFT")
          for letter, types in codes.types.items() for i in range(1, len(types), 4)),
        *observation_lines(letters, rows),
        leap_seconds(int(tags_ns[0])),
        labelled("", "END OF HEADER"),
    ]  # fmt: skip
    return "".join(lines)
