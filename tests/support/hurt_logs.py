"""Logs into which faults are written by hand: lines, by epoch, with names and streams by cantools."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import cantools
import numpy as np

from gnss_hil.dbc.contract import codec, e2e


class Log:
    """Lines of a log by epoch, and names of their messages and senders by cantools."""

    def __init__(self, folder: Path):
        self.path = folder / "bus.log"
        text = codec.codec(4).text
        self.messages = {m.frame_id: m for m in cantools.database.load_string(text).messages}
        self.epochs: list[list[str]] = []
        for line in self.path.read_text().splitlines():
            if self.name(line) == "TIME_MARK":
                self.epochs.append([])
            self.epochs[-1].append(line)

    def message(self, line: str):
        return self.messages[int(line.split()[2].partition("#")[0], 16)]

    def name(self, line: str) -> str:
        return self.message(line).name

    def row(self, epoch: int, name: str) -> int:
        return next(i for i, line in enumerate(self.epochs[epoch]) if self.name(line) == name)

    def take_out(self, epoch: int, which: Callable[[str], bool]) -> set[tuple]:
        """Streams of the lines that are taken out of an epoch."""
        gone = {self.stream(line) for line in self.epochs[epoch] if which(line)}
        self.epochs[epoch] = [line for line in self.epochs[epoch] if not which(line)]
        return gone

    def stream(self, line: str) -> tuple:
        """Message and, where it has one, the signal that tells its streams apart (docs/contract.md)."""
        message = self.message(line)
        if not message.name.startswith(("RX", "NAV_")):
            return (message.name,)
        values = message.decode(bytes.fromhex(line.partition("#")[2]), decode_choices=False)
        keys = ("channel", "item", "receiver")
        return message.name, *(values[key] for key in keys if key in values)

    def missed(self, streams: set[tuple], since: int) -> Counter[tuple]:
        """LOST, once for each stream, where it goes on."""
        found: Counter[tuple] = Counter()
        for epoch in range(since, len(self.epochs)):
            for line in self.epochs[epoch]:
                if (stream := self.stream(line)) in streams:
                    streams = streams - {stream}
                    found[float(epoch), "LOST", stream[0]] += 1
        return found

    def rewrite(self, epoch: int, name: str, **changed: int) -> None:
        """Give a message of an epoch other raw values, under a CRC that fits them."""
        at = self.row(epoch, name)
        stamp, bus, frame = self.epochs[epoch][at].split()
        identifier, _, payload = frame.partition("#")
        message = self.messages[int(identifier, 16)]
        values = message.decode(bytes.fromhex(payload), scaling=False, decode_choices=False) | changed
        data = np.frombuffer(message.encode(values, scaling=False), np.uint8).reshape(1, 8).copy()
        data[0, 0] = e2e.crc(np.array([message.frame_id]), data)[0]
        self.epochs[epoch][at] = f"{stamp} {bus} {identifier}#{data.tobytes().hex().upper()}"

    def like(self, epoch: int, identifier: str) -> str:
        """A frame with an identifier at an epoch's beginning."""
        stamp, bus, _ = self.epochs[epoch][0].split()
        return f"{stamp} {bus} {identifier}#0011223344556677"

    def written(self, before: list[str]) -> Path:
        lines = [*before, *(line for epoch in self.epochs for line in epoch)]
        self.path.write_text("\n".join(lines) + "\n")
        return self.path.parent
