"""The bus as a time master sees it: protected frames out, answers in, start barrier, lockstep.

From docs/contract.md and the DBC beside this file; nothing here knows what is measured.
"""

import hashlib
import random
import sys
import time
from collections import Counter
from pathlib import Path

import can
import cantools

DBC = Path(__file__).with_name("gnss.dbc")
DB = cantools.database.load_file(DBC)
HASH = int.from_bytes(hashlib.sha256(DBC.read_text("ascii").encode()).digest()[:4], "big")  # lines end in LF
HEARD = {DB.get_message_by_name(n).frame_id: n for n in ("FLIGHT_HEARTBEAT", "RX1_COMMAND", "BENCH_DONE")}


def protection(can_id, data):
    """Byte 0 of a frame: the CRC-8 of AUTOSAR E2E profile 11 over identifier and bytes 1 to 7."""
    crc = 0
    for byte in can_id.to_bytes(2, "little") + data[1:]:
        crc ^= byte
        for _ in range(8):
            crc = crc << 1 ^ (0x11D if crc & 0x80 else 0)
    return crc


class Bench:
    """The bus as the time master sees it: what is said in an epoch, and what the flight software answers."""

    def __init__(self, spec):
        interface, channel = spec.split(":", 1)
        self.bus = can.Bus(interface={"embedded": "gnss-hil"}.get(interface, interface), channel=channel)
        self.session, self.epoch, self.sent = random.getrandbits(16), 0, 0
        self.counters, self.commands, self.refused = Counter(), [], 0

    def open(self, epoch):
        """Begins an epoch; returns the commands that act in it."""
        self.epoch, self.sent, commands, self.commands = epoch, 0, self.commands, []
        return commands

    def send(self, name, **signals):
        """One frame of the open epoch, protected."""
        message, stream = DB.get_message_by_name(name), (name, signals.get("channel"))
        counter = {"e2e_crc": 0, "e2e_counter": self.counters[stream] % 15, "epoch_mod16": self.epoch % 16}
        data = bytearray(message.encode(signals | counter))
        data[0] = protection(message.frame_id, data)
        self.counters[stream] += 1
        self.sent += 1
        self.bus.send(can.Message(arbitration_id=message.frame_id, data=data, is_extended_id=False))

    def steer(self, name, **signals):
        """One of the bench's own frames; it is none of the block."""
        self.send(name, session=self.session, epoch=self.epoch % 65536, **signals)
        self.sent -= 1

    def believes(self, signals):
        """Whether a bench frame counts: of the session, of the epoch or one beside it."""
        return signals["session"] == self.session and (signals["epoch"] - self.epoch + 1) % 65536 <= 2

    def hear(self, wait_s):
        """(name, signals) of what the flight software says, until nothing more comes and `wait_s` are over.

        What is damaged, or a DONE of something else, is counted; commands are kept for the next epoch.
        """
        end_s = time.monotonic() + wait_s
        while (message := self.bus.recv(max(0.0, end_s - time.monotonic()))) is not None:
            name = None if message.is_extended_id else HEARD.get(message.arbitration_id)
            if name is None:
                continue
            can_id, data = message.arbitration_id, message.data
            sound = len(data) == 8 and data[0] == protection(can_id, data)
            signals = DB.decode_message(name, data, decode_choices=False) if sound else {}
            sound = sound and signals["e2e_counter"] < 15
            if not sound or (name == "BENCH_DONE" and not self.believes(signals)):
                self.refused += 1
                continue
            if name == "RX1_COMMAND" and (self.epoch - signals["epoch_mod16"]) % 16 <= 3:
                self.commands.append(signals)
            yield name, signals

    def heartbeats(self, state):
        for node in ("RX1", "ATT", "TIME"):
            self.send(f"{node}_HEARTBEAT", state=state, boot_count=0, contract_hash=HASH)

    def assemble(self):
        """The start barrier: heartbeats with counter 0 until the flight software's was heard."""
        strangers = set()
        while True:
            self.counters.clear()
            self.heartbeats("READY")
            for spoken in (said.get("contract_hash") for _, said in self.hear(0.1)):
                if spoken == HASH:
                    return
                if spoken is not None and spoken not in strangers:
                    strangers.add(spoken)
                    print(f"FLIGHT speaks contract {spoken:08x}, {DBC.name} is {HASH:08x}", file=sys.stderr)

    def lockstep(self):
        """Ends the block and waits for the answer; TimeoutError if ten repetitions bring none."""
        for _ in range(10):
            self.steer("BENCH_SYNC", count=self.sent)
            for name, said in self.hear(1.0):
                if name == "BENCH_DONE" and said["epoch"] == self.epoch % 65536:
                    return
        raise TimeoutError(f"epoch {self.epoch}: no BENCH_DONE within 10 s")

    def listen(self, wait_s):
        """Without lockstep: what is heard in time belongs to the next epoch."""
        for _ in self.hear(wait_s):
            pass

    def end(self, epochs):
        self.epoch = epochs  # the one that will not come
        self.steer("BENCH_END", reason="COMPLETED")
        self.bus.shutdown()
