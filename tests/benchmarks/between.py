"""A gateway between two buses of sockets, with an emulator and a flight software that only play a tape."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Sequence

from gnss_hil.dbc.bus.embedded import EmbeddedLink
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat, to_wire
from gnss_hil.dbc.lockstep import messages
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.engine import FaultPlan
from gnss_hil.tools.gateway.crossing import Crossing
from gnss_hil.tools.gateway.loop import run_gateway
from gnss_hil.tools.gateway.one_frame import Reader
from gnss_hil.tools.gateway.strikes import Strikes

Tape = Sequence[tuple[FrameBatch, FrameBatch]]
"""What emulator and flight software sent in each epoch."""


def passing(tape: Tape, plan: FaultPlan) -> Callable[[range], None]:
    """What passes epochs of a tape through a gateway with these faults, in lockstep."""
    crossing = Crossing(plan.codec, Strikes(lambda session: plan))
    wires = _wires(tape, plan.codec)

    def play(epochs: range) -> None:
        source, emulator = socket.socketpair()
        sink, flight = socket.socketpair()
        links = {Direction.RECEIVERS: EmbeddedLink(source), Direction.FLIGHT: EmbeddedLink(sink)}
        crossed = wires[epochs.start : epochs.stop]
        playing = threading.Thread(target=_exchange, args=(crossed, emulator, flight))
        playing.start()
        run_gateway(links, crossing, lambda: not playing.is_alive())
        for one in (source, emulator, sink, flight):
            one.close()

    return play


def meeting(tape: Tape, codec: Codec) -> Callable[[range], None]:
    """The same with nothing between them."""
    wires = _wires(tape, codec)

    def play(epochs: range) -> None:
        emulator, flight = socket.socketpair()
        _exchange(wires[epochs.start : epochs.stop], emulator, flight)
        emulator.close()
        flight.close()

    return play


def _wires(tape: Tape, codec: Codec) -> list[tuple[bytes, bytes]]:
    """What crosses in each epoch, closed by SYNC and DONE."""
    (session,) = Reader(codec, "TIME_MARK", "session").first(tape[0][0]) or (0,)

    def closed(frames: FrameBatch, by: int, epoch: int) -> bytes:
        return to_wire(concat((frames, messages.encode(by, session, epoch, len(frames)))))

    return [
        (closed(block, messages.SYNC_ID, epoch), closed(answer, messages.DONE_ID, epoch))
        for epoch, (block, answer) in enumerate(tape)
    ]


def _exchange(wires: Sequence[tuple[bytes, bytes]], emulator: socket.socket, flight: socket.socket) -> None:
    for block, answer in wires:
        for wire, here, there in ((block, emulator, flight), (answer, flight, emulator)):
            here.sendall(wire)
            assert there.recv(len(wire), socket.MSG_WAITALL) == wire
