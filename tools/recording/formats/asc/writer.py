"""Vector's ASC, written: text, times relative to a start in local time.

    date Wed Oct 31 12:15:00.000 am 2012
    base hex  timestamps absolute
    internal events logged
    Begin Triggerblock Wed Oct 31 12:15:00.000 am 2012
       0.000000 Start of measurement
       0.000111 1  101             Rx   d 8 8A 00 03 04 05 06 07 FF

Why not python-can's writer: its `date` is the time of writing, and its milliseconds have no leading zeros, so
that the start is read back wrong. Here the start is a whole second, and every microsecond survives. An
error frame has neither identifier nor payload nor direction in this format.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG
from gnss_hil.tools.recording.formats.piece import Piece

_DAYS = "Mon Tue Wed Thu Fri Sat Sun".split()
_MONTHS = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()
_SECOND_US = 1_000_000


def _date(unix_s: int) -> str:
    """As Vector writes it, in whatever locale: 'Wed Oct 31 12:15:00.000 am 2012', local time."""
    t = datetime.fromtimestamp(unix_s)
    half = "am" if t.hour < 12 else "pm"
    return f"{_DAYS[t.weekday()]} {_MONTHS[t.month - 1]} {t:%d %I:%M:%S}.000 {half} {t:%Y}"


def _event(channel: int, can_id: int, length: int, data: bytes, sent: bool) -> str:
    if can_id & ERR_FLAG:
        return f"{channel}  ErrorFrame"
    name = f"{can_id & EFF_MASK:X}{'x' if can_id & EFF_FLAG else ''}"
    direction = "Tx" if sent else "Rx"
    if can_id & RTR_FLAG:
        return f"{channel}  {name:<15} {direction}   r {length:x}"
    return f"{channel}  {name:<15} {direction}   d {length:x} {data[:length].hex(' ').upper()}".rstrip()


class AscWriter:
    """channels  number of each bus, from 0; they are from 1 in the file."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        self._file = path.open("w", encoding="ascii")
        self._channels = channels
        self._start_us: int | None = None

    def _begin(self, unix_us: int) -> None:
        start_s = unix_us // _SECOND_US
        self._start_us = start_s * _SECOND_US
        date = _date(start_s)
        self._file.write(
            f"date {date}\nbase hex  timestamps absolute\ninternal events logged\n"
            f"Begin Triggerblock {date}\n   0.000000 Start of measurement\n"
        )

    def write(self, piece: Piece) -> None:
        unix_us, bus, frames, sent = piece
        if self._start_us is None and len(frames):
            self._begin(int(unix_us[0]))
        lines = [
            f"{elapsed_us / _SECOND_US:11.6f} {_event(self._channels[name] + 1, *frame)}\n"
            for elapsed_us, name, *frame in zip(
                (unix_us - (self._start_us or 0)).tolist(), bus.tolist(), frames.can_id.tolist(),
                frames.length.tolist(), map(bytes, frames.data), sent.tolist(), strict=True,
            )
        ]  # fmt: skip
        self._file.writelines(lines)

    def close(self) -> None:
        if self._start_us is None:
            self._begin(0)
        self._file.write("End TriggerBlock\n")
        self._file.close()
