"""A bench in a few lines, for flight software of others: plays recorded epochs over an embedded bus.

Shares no code with the bench but the layout of the bench frames.
"""

from __future__ import annotations

import os
import socket
import struct
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

import cantools

from gnss_hil.dbc.common.vehicle import find
from tests.support.programs import ROOT
from tests.support.waiting import HANG_S, ended

_FRAME = struct.Struct("=IB3x8s")  # struct can_frame
_BENCH = struct.Struct("<BBHHH")
SYNC, DONE, END = 0x7D0, 0x7D1, 0x7DE
TIME_MARK, HEARTBEAT = 0x010, 0x710

Frame = tuple[int, bytes]
"""Identifier and data."""


@cache
def database() -> cantools.Database:
    return cantools.database.load_file(ROOT / "dbc" / "contract" / "gnss.dbc")


def is_flights(can_id: int) -> bool:
    """Whether the flight software sends it."""
    return 0x020 <= can_id < 0x030 or 0x040 <= can_id < 0x060 or can_id == HEARTBEAT


def recorded(log: Path) -> list[list[Frame]]:
    """What the emulator said in each epoch of a bus.log."""
    epochs: list[list[Frame]] = []
    with log.open() as lines:
        for line in lines:
            name, _, data = line.split()[2].partition("#")
            frame = int(name, 16), bytes.fromhex(data)
            if frame[0] == TIME_MARK:
                epochs.append([])
            if not is_flights(frame[0]):
                epochs[-1].append(frame)
    return epochs


def pack(can_id: int, data: bytes, length: int | None = None) -> bytes:
    return _FRAME.pack(can_id, len(data) if length is None else length, data)


def decoded(frames: Iterable[Frame]) -> dict[str, list[dict]]:
    """Messages by name, in the order in which they came."""
    messages: dict[str, list[dict]] = {}
    for can_id, data in frames:
        message = database().get_message_by_frame_id(can_id)
        messages.setdefault(message.name, []).append(message.decode(data))
    return messages


def protection(can_id: int, data: bytes) -> int:
    """The CRC-8 of AUTOSAR E2E profile 11 over identifier and bytes 1 to 7."""
    crc = 0
    for byte in can_id.to_bytes(2, "little") + data[1:]:
        crc ^= byte
        for _ in range(8):
            crc = crc << 1 ^ (0x11D if crc & 0x80 else 0)
    return crc


def bench(can_id: int, session: int, epoch: int, count: int) -> bytes:
    """A bench frame as on the wire."""
    data = bytearray(_BENCH.pack(0, epoch % 15 | epoch % 16 << 4, epoch % 65536, session, count))
    data[0] = protection(can_id, bytes(data))
    return pack(can_id, bytes(data))


class Feeder:
    """A flight software and the socket that is its bus."""

    def __init__(self, program: Path, folder: Path, arguments: Sequence[str] = (), environment: Mapping = {}):
        path = folder / "bus.sock"
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.bind(str(path))
        os.chmod(path, 0o600)
        self._server.listen(1)
        self.process = subprocess.Popen(
            [program, "--bus", f"embedded:{path}", "--vehicle", find("soyuz-ms"), *arguments],
            stderr=subprocess.PIPE, text=True, env={**os.environ, **environment},
        )  # fmt: skip
        self._server.settimeout(HANG_S)
        self.bus, _ = self._server.accept()
        self.bus.settimeout(HANG_S)
        self._rest = b""

    def __enter__(self) -> Feeder:
        return self

    def __exit__(self, *_) -> None:
        self.bus.close()
        self._server.close()
        self.process.kill()
        self.process.wait()
        self.process.stderr.close()

    def send(self, raw: bytes) -> None:
        self.bus.sendall(raw)

    def receive(self) -> Frame:
        """The next frame of the flight software."""
        while len(self._rest) < _FRAME.size:
            piece = self.bus.recv(1 << 16)
            if not piece:
                raise EOFError(f"the flight software left: {self.process.stderr.read()}")
            self._rest += piece
        can_id, length, data = _FRAME.unpack(self._rest[: _FRAME.size])
        self._rest = self._rest[_FRAME.size :]
        return can_id, data[:length]

    def answer(self, session: int, epoch: int) -> list[Frame]:
        """What it sends up to its DONE; start heartbeats before the first NAV_STATUS are passed over."""
        frames: list[Frame] = []
        while (frame := self.receive())[0] != DONE:
            if frames or frame[0] != HEARTBEAT:
                frames.append(frame)
        assert _BENCH.unpack(frame[1])[2:] == (epoch % 65536, session, len(frames))
        assert frame[1][0] == protection(*frame)
        return frames

    def sync(self, session: int, epoch: int, count: int) -> list[Frame]:
        self.send(bench(SYNC, session, epoch, count))
        return self.answer(session, epoch)

    def play(self, epoch: Sequence[Frame], noise: Iterable[bytes] = ()) -> list[Frame]:
        """One epoch in lockstep, with raw frames strewn in; the answer."""
        raw = [pack(*frame) for frame in epoch]
        for number, stray in enumerate(noise):
            raw.insert(1 + 7 * number % len(raw), stray)
        mark = database().decode_message("TIME_MARK", epoch[0][1])
        self.send(b"".join(raw))
        return self.sync(mark["session"], mark["epoch"], len(epoch))

    def end(self, session: int, epochs: int) -> tuple[int, str]:
        """BENCH_END; exit status and last words."""
        self.send(bench(END, session, epochs, 0))
        return self.leave()

    def leave(self) -> tuple[int, str]:
        _, words = ended(self.process)
        return self.process.returncode, words


def session_of(epoch: Sequence[Frame]) -> int:
    return database().decode_message("TIME_MARK", epoch[0][1])["session"]
