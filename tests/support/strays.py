"""Strays on the bus of a whole run: one frame at a bad moment, and what the run says of it.

    python -m tests.support.strays [--flight fsw] [--kinds KIND ...]

plays every kind of stray at every moment, in lockstep and at a pace, with our flight software and with the
C example if its program is named, and prints a row each. A run passes if its record has the fixes that were
flown, or its exit status is not 0; it must end.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import socket
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from gnss_hil.dbc.lockstep.messages import session_of
from tests.support.feeder import DONE, END, SYNC, TIME_MARK, bench, pack, protection
from tests.support.programs import GNSS_HIL
from tests.support.waiting import HANG_S, exit_status, until

EPOCHS = 100
SESSION = session_of(1)
_FRAME = struct.Struct("=IB3x8s")


def mark(session: int, epoch: int, counter: int = 7) -> bytes:
    """A TIME_MARK with a sound CRC."""
    data = bytearray(struct.pack("<BBHI", 0, epoch % 16 << 4 | counter, session, epoch % 2**32))
    data[0] = protection(TIME_MARK, bytes(data))
    return pack(TIME_MARK, bytes(data))


def forged(can_id: int, epoch: int, payload: bytes) -> bytes:
    """A frame of a node of the run, by somebody else."""
    data = bytearray(b"\0" + bytes([epoch % 16 << 4 | 3]) + payload)
    data[0] = protection(can_id, bytes(data))
    return pack(can_id, bytes(data))


STRAYS: dict[str, Callable[[int], bytes]] = {
    "end-empty": lambda k: pack(END, b""),
    "end-other-session": lambda k: bench(END, 0xBEEF, k + 1, 0),
    "end-other-epoch": lambda k: bench(END, SESSION, k + 400, 0),
    "sync-other-session": lambda k: bench(SYNC, 0xBEEF, k, 9),
    "sync-last": lambda k: bench(SYNC, SESSION, 2**32 - 1, 0),
    "sync-ahead": lambda k: bench(SYNC, SESSION, k + 7, 0),
    "sync-own": lambda k: bench(SYNC, SESSION, k, 3),
    "done-other-session": lambda k: bench(DONE, 0xBEEF, k, 3),
    "done-last": lambda k: bench(DONE, SESSION, 2**32 - 1, 0),
    "done-own": lambda k: bench(DONE, SESSION, k, 1),
    "uds-request": lambda k: pack(0x7DF, bytes.fromhex("023E800000000000")),
    "uds-ecu": lambda k: pack(0x7E0, bytes.fromhex("023E800000000000")),
    "uds-response": lambda k: pack(0x7EF, bytes.fromhex("027E000000000000")),
    "mark-other-session": lambda k: mark(0xBEEF, 5),
    "mark-next": lambda k: mark(SESSION, k + 1),
    "mark-16": lambda k: mark(SESSION, k + 16),
    "mark-4096": lambda k: mark(SESSION, k + 4096),
    "mark-far": lambda k: mark(SESSION, k + 2**31),
    "mark-back": lambda k: mark(SESSION, max(0, k - 40)),
    "position-forged": lambda k: forged(0x041, k, bytes(6)),
}
MOMENTS = ("before", "start", "amid", "near-end", "after")
PACES = ("lockstep", "x50")


@dataclass(frozen=True, slots=True)
class Result:
    """How a run with a stray ended: exit status, fixes on record and flown, None where it never flew."""

    status: int
    recorded: int | None
    flown: int | None
    words: str

    @property
    def honest(self) -> bool:
        return self.status != 0 or (self.flown is not None and self.recorded == self.flown)


class Listener:
    """A peer of the bus that hears it and speaks once."""

    def __init__(self, path: Path, run: subprocess.Popen):
        self._sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        until(lambda: self._sock.connect_ex(os.fspath(path)) == 0, run)
        self._sock.settimeout(HANG_S)

    def say(self, wire: bytes) -> None:
        with suppress(OSError):
            self._sock.sendall(wire)

    def frames(self) -> Iterator[tuple[int, bytes]]:
        rest = b""
        while piece := self._sock.recv(1 << 16):
            rest += piece
            whole = len(rest) // _FRAME.size * _FRAME.size
            for row in range(0, whole, _FRAME.size):
                can_id, length, data = _FRAME.unpack_from(rest, row)
                yield can_id, data[:length]
            rest = rest[whole:]

    def close(self) -> None:
        self._sock.close()


def _speak(listener: Listener, stray: Callable[[int], bytes], moment: str) -> None:
    """The stray at its moment; then the bus is heard to its end."""
    at = {"before": -1, "start": 0, "amid": EPOCHS // 2, "near-end": EPOCHS - 2, "after": None}[moment]
    said = at == -1
    if said:
        listener.say(stray(0))
    for can_id, data in listener.frames():
        reached = can_id == END if at is None else can_id == TIME_MARK and _epoch(data) >= at
        if reached and not said:
            said = True
            listener.say(stray(EPOCHS if at is None else _epoch(data)))


def _epoch(data: bytes) -> int:
    return struct.unpack_from("<I", data, 4)[0]


def run(kind: str, moment: str, pace: str, flight: Path | None = None) -> Result:
    """A run of its own processes with one stray on its bus."""
    with tempfile.TemporaryDirectory(prefix="strays-") as name:
        folder = Path(name)
        command = [
            *GNSS_HIL, "run", "soyuz", "--duration", str(EPOCHS), "--pace", pace,
            "--bus", f"embedded:{folder / 'bus'}", "--out", str(folder / "run"), "--no-report", "--quiet",
            *([] if flight is None else ["--flight", f"{flight} --tell"]),
        ]  # fmt: skip
        with (folder / "err").open("w") as words:
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=words)
        try:
            listener = Listener(folder / "bus", process)
            with suppress(OSError):
                _speak(listener, STRAYS[kind], moment)
            listener.close()
            status = exit_status(process)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
        return _result(folder, status)


def _result(folder: Path, status: int) -> Result:
    words = (folder / "err").read_text()
    summary, facts = folder / "run" / "summary.json", folder / "run" / "run.json"
    if not summary.exists():
        return Result(status, None, None, words)
    (craft,) = json.loads(summary.read_text())["craft"].values()
    told = re.search(r"^fsw: \d+ epochs, (\d+) fixes", words, re.M)
    flown = int(told[1]) if told else next(iter(json.loads(facts.read_text())["fixes_flown"].values()))
    return Result(status, craft["fixes"], flown, words)


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.support.strays", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--flight", type=Path, help="program of examples/fsw_c; it is flown too")
    parser.add_argument("--kinds", nargs="+", choices=STRAYS, default=list(STRAYS), metavar="KIND")
    options = parser.parse_args()
    flights = [None, *([options.flight] if options.flight else [])]
    dishonest = quiet = 0
    for kind, moment, pace, flight in product(options.kinds, MOMENTS, PACES, flights):
        result = run(kind, moment, pace, flight)
        dishonest += not result.honest
        quiet += result.status == 0
        who = "ours" if flight is None else flight.name
        verdict = "ok" if result.honest else "DISHONEST"
        fixes = f"{result.recorded} fixes on record, {result.flown} flown"
        print(f"{kind:18} {moment:9} {pace:9} {who:5} status {result.status}, {fixes}: {verdict}", flush=True)
    total = len(options.kinds) * len(MOMENTS) * len(PACES) * len(flights)
    print(f"{total} runs: {quiet} with status 0, {dishonest} whose record is not the flight")
    return 1 if dishonest else 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
