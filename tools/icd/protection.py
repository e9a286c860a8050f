"""Protection worked out by hand: what `gnss_hil.dbc.contract.e2e` computes for a frame, with every step
between."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.e2e import COUNTERS, TABLE
from gnss_hil.dbc.contract.frames import FrameBatch, batch
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.io.frame_statistics import CONSEQUENCE, Reason
from gnss_hil.tools.icd.prose import render
from gnss_hil.tools.report.markup import Markup, joined, table, tag

EPOCH = 37


@dataclass(frozen=True, slots=True)
class Vector:
    """A frame of the published test vectors: first of its stream (counter 0), sent in epoch EPOCH."""

    kind: str
    number: int
    values: Mapping[str, float]

    def frame(self, codec: Codec) -> FrameBatch:
        can_id = codec.can_id_of[self.kind, self.number]
        plain = batch(can_id, codec.encode(self.kind, self.values))
        return e2e.protect(codec, plain, e2e.fresh_counters(codec), EPOCH)[0]


VECTORS = (
    Vector("RANGE", 1, {"channel": 3, "pseudorange_m": 21345678.9012}),
    Vector("SV_CLOCK", 1, {"channel": 3, "sat_system": 1, "sat_number": 21, "clock_m": -12345.678}),
    Vector("COMMAND", 2, {"channel": 5, "action": 1, "sat_number": 7, "transaction": 291}),
    Vector("ATT_Q01", 0, {"q0": 0.5, "q1": -0.5}),
)
"""As in the table of test vectors; a RX2_COMMAND needs a contract of two receivers or more."""


@dataclass(frozen=True, slots=True)
class CrcStep:
    """One byte through the CRC: `index` = `before` XOR `byte`, `after` = TABLE[`index`]."""

    source: str
    byte: int
    before: int
    index: int
    after: int


def crc_steps(data_id: int, payload: bytes) -> Iterator[CrcStep]:
    """Data id low and high byte, then bytes 1 to 7, from zero on; the last `after` is the CRC."""
    sources = [("data id, low", data_id & 0xFF), ("data id, high", data_id >> 8)]
    sources += [(f"byte {k}", byte) for k, byte in enumerate(payload) if k]
    crc = 0
    for source, byte in sources:
        index = crc ^ byte
        after = int(TABLE[index])
        yield CrcStep(source, byte, crc, index, after)
        crc = after


def _hex(value: int) -> Markup:
    return tag.code(f"{value:02X}")


def _raw_signals(codec: Codec, vector: Vector) -> Iterator[tuple]:
    """Rows: signal, value, raw integer, start bit."""
    layout = codec.kinds[vector.kind]
    for signal, value in vector.values.items():
        k = layout.signals.index(signal)
        raw = round((value - float(layout.offset[k])) / float(layout.factor[k]))
        yield tag.code(signal), str(value), str(raw), int(layout.shift[k])


def _worked(codec: Codec, vector: Vector, name: str) -> Markup:
    frame = vector.frame(codec)
    payload, can_id = frame.data[0].tobytes(), int(frame.can_id[0])
    word = int.from_bytes(payload, "little") & ~0xFFFF
    shown = payload.hex(" ").upper()
    steps = ((s.source, *map(_hex, (s.byte, s.before, s.index, s.after))) for s in crc_steps(can_id, payload))
    return tag.section(
        tag.h4(name),
        table(("signal", "value", "raw integer", "start bit"), _raw_signals(codec, vector), (1, 2, 3)),
        render(
            f"The raw integers at their start bits make the 64-bit word `0x{word:016X}`, sent lowest byte "
            f"first. Byte 1 is `{payload[1]:02X}`: epoch {EPOCH} modulo 16 is {EPOCH % 16} in the high "
            f"nibble, counter {payload[1] & 15} in the low one. The CRC goes to byte 0:"
        ),
        table(
            ("into the CRC", "byte", "CRC before", "index = CRC XOR byte", "CRC after = T[index]"),
            steps, class_="crc", data_id=f"0x{can_id:03X}", data_payload=shown,
        ),
        render(f"On the bus: identifier `0x{can_id:03X}`, data `{shown}`."),
        class_="keep",
    )  # fmt: skip


def later_frames(codec: Codec) -> Markup:
    """The first vector sent again in every epoch: how counter, nibble and CRC go on."""
    vector = VECTORS[0]
    can_id = codec.can_id_of[vector.kind, vector.number]
    plain, counters, rows = (
        batch(can_id, codec.encode(vector.kind, vector.values)),
        e2e.fresh_counters(codec),
        [],
    )
    for epoch in range(EPOCH, EPOCH + COUNTERS + 2):
        sealed, counters = e2e.protect(codec, plain, counters, epoch)
        data = sealed.data[0].tobytes()
        rows.append((epoch, epoch % 16, data[1] & 15, tag.code(data.hex(" ").upper())))
    chosen = [rows[k] for k in (0, 1, 2, COUNTERS - 1, COUNTERS, COUNTERS + 1)]
    return tag.section(
        tag.h4("The same frame in later epochs"),
        tag.p("The counter goes from 14 to 0, the epoch's nibble from 15 to 0: they part company."),
        table(("epoch", "modulo 16", "counter", "data"), chosen, (0, 1, 2)),
        class_="keep",
    )


def worked_examples(codec: Codec) -> Iterator[Markup]:
    """Test vectors that the contract has, one of them in later epochs, and the CRC's table."""
    names = {can_id: f"RX{n}_{kind}" if n else kind for (kind, n), can_id in codec.can_id_of.items()}
    for vector in VECTORS:
        if can_id := codec.can_id_of.get((vector.kind, vector.number)):
            yield _worked(codec, vector, names[can_id])
    yield later_frames(codec)
    yield tag.section(tag.h4("T: CRC-8 of each byte"), crc_table(), class_="keep")


def crc_table() -> Markup:
    """T, the CRC of each byte, in rows of sixteen."""
    head = ["", *(f"_{k:X}" for k in range(16))]
    rows = ([tag.b(f"{row:X}_"), *map(_hex, TABLE[16 * row : 16 * row + 16].tolist())] for row in range(16))
    return table(head, rows, class_="hex")


def advance_verdict(codec: Codec, advance: int) -> Verdict:
    """What `screen` says of a frame whose counter is `advance` steps on from the last one accepted."""
    can_id = codec.can_id_of["TIME_MARK", 0]
    plain = batch(np.full(2, can_id), np.zeros((2, 8), np.uint8))
    at = codec.key_of(np.array([can_id]), np.zeros((1, 8), np.uint8))
    before = e2e.fresh_counters(codec)
    before[at] = (advance - 1) % COUNTERS
    sealed, _ = e2e.protect(codec, plain[:1], before, 0)
    received = e2e.fresh_counters(codec)
    received[at] = 0
    return Verdict(int(screening.screen(codec, sealed, received).verdict[0]))


def advances(codec: Codec) -> Markup:
    """Verdict by counter advance, as the screen gives it; equal neighbours share a row."""
    rows = []
    for verdict, same in groupby(range(COUNTERS), lambda advance: advance_verdict(codec, advance)):
        steps = list(same)
        span = joined(dict.fromkeys((steps[0], steps[-1])), " to ")
        used = "yes" if verdict <= Verdict.LOST else "no"
        rows.append((span, in_words(verdict.name), used, screening.CONSEQUENCE.get(verdict, "frame used")))
    return table(("counter advance", "state", "used", "consequence"), rows, class_="advances")


_ORDER_OF_CHECKS = (
    Verdict.ERROR_FRAME, Verdict.EXTENDED, Verdict.REMOTE, Verdict.WRONG_LENGTH, Verdict.UNKNOWN_ID,
    Reason.OTHER_SESSION, Verdict.CORRUPTED, Verdict.MIXED_EPOCH, Reason.OTHER_CONTRACT,
    Verdict.REPEATED, Verdict.WRONG_SEQUENCE, Verdict.LOST, Reason.STREAM_NOT_VALID,
    Reason.BAD_TIME_MARK, Reason.NO_TIME_MARK, Reason.JUMPED,
    Reason.SURPLUS, Reason.INCOMPLETE, Reason.CONTRADICTED, Reason.NO_ORBIT, Reason.MOVED, Reason.TURNED,
    Reason.TIMED_OUT,
)  # fmt: skip


def reasons() -> Markup:
    """Why the flight software refuses a frame, and what then."""
    rows = ((in_words(reason.name), CONSEQUENCE[reason]) for reason in _ORDER_OF_CHECKS)
    return table(("reason", "consequence"), rows, class_="reasons")


def in_words(name: str) -> str:
    return name.replace("_", " ").lower()
