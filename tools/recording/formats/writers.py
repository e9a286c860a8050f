"""Writers of recordings: candump and BLF. ASC and MF4 have files of their own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gnss_hil.tools.recording.formats.candump import Piece, format_lines


class CandumpWriter:
    """Text of `candump -l`."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        self._file = path.open("wb")

    def write(self, piece: Piece) -> None:
        unix_us, bus, frames = piece
        names = np.unique(bus).tolist()
        if len(names) == 1:
            self._file.write(format_lines(unix_us, frames, names[0].decode()))
            return
        lines = np.empty(len(frames), object)
        for name in names:
            mine = bus == name
            text = format_lines(unix_us[mine], frames[mine], name.decode())
            lines[mine] = text.splitlines(keepends=True)
        self._file.write(b"".join(lines))

    def close(self) -> None:
        self._file.close()


class BlfWriter:
    """python-can's writer of Vector's binary log."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        import can

        self._channels = channels
        self._log = can.BLFWriter(path)

    def write(self, piece: Piece) -> None:
        from gnss_hil.tools.recording.formats.messages import messages_of

        for message in messages_of(piece, self._channels):
            self._log.on_message_received(message)

    def close(self) -> None:
        self._log.stop()
