"""Frames in formatter: names of identifiers, values of signals with as many digits as their steps have."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG, SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import HEADER_NAMES, KIND_BY_NAME, messages
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.block import payloads

UNKNOWN = "?"
_UNREADABLE = frozenset(Verdict) - {
    Verdict.OK, Verdict.LOST, Verdict.REPEATED, Verdict.WRONG_SEQUENCE
}  # fmt: skip
"""Checks after which a payload means nothing: its bytes are shown instead of values."""


def identifier(can_id: int) -> str:
    """'100', '1ABCDEF0' (extended or error frame), as candump writes it."""
    if can_id & (EFF_FLAG | ERR_FLAG):
        return f"{can_id & (EFF_MASK | ERR_FLAG):08X}"
    return f"{can_id & SFF_MASK:03X}"


def payload(can_id: int, length: int, data: NDArray[np.uint8]) -> str:
    """'DF 50 83'; 'remote, length 4'."""
    return f"remote, length {length}" if can_id & RTR_FLAG else data[:length].tobytes().hex(" ").upper()


def check(verdict: int) -> str:
    """'ok', 'wrong sequence'."""
    return Verdict(verdict).name.lower().replace("_", " ")


class Formatter:
    """The contract's names, and its signals as text."""

    def __init__(self, codec: Codec):
        self._codec = codec
        names = {message.can_id: message.name for message in messages(codec.receivers)}
        self.name_of = tuple(names.get(can_id, UNKNOWN) for can_id in range(IDENTIFIERS))
        self._writers = {kind: _writers(codec, kind) for kind in codec.kinds}
        self._kinds = tuple(codec.kinds)

    def name(self, can_id: int) -> str:
        return self.name_of[can_id] if can_id <= SFF_MASK else UNKNOWN

    def sender(self, can_id: int) -> str:
        return self._codec.sender_of[can_id] if can_id <= SFF_MASK else ""

    def values(self, frames: FrameBatch, verdict: NDArray[np.uint8]) -> list[str]:
        """(n,) 'channel=3 lock=FULL' of frames that passed the checks, the bytes of others."""
        texts = [""] * len(frames)
        ids = frames.can_id.tolist()
        readable = ~np.isin(verdict, [int(v) for v in _UNREADABLE])
        for i in np.flatnonzero(~readable):
            texts[i] = payload(ids[i], int(frames.length[i]), frames.data[i])
        kind_of = np.where(readable, self._codec.kind_of[frames.can_id & SFF_MASK], -1)
        for number in np.unique(kind_of[readable]):
            rows = np.flatnonzero(kind_of == number)
            for i, text in zip(rows, self._decoded(self._kinds[number], frames[rows]), strict=True):
                texts[i] = text
        return texts

    def _decoded(self, kind: str, frames: FrameBatch) -> list[str]:
        layout, payload_words = self._codec.kinds[kind], payloads(frames)
        columns = [
            [write(value) for value in layout.signal(name, payload_words).tolist()]
            for name, write in self._writers[kind]
        ]
        return list(map(" ".join, zip(*columns, strict=True)))


def _writers(codec: Codec, kind: str) -> list[tuple[str, Callable[[float], str]]]:
    """How each payload signal of a kind is written."""
    layout = codec.kinds[kind]
    labels = {s.name: VALUES[s.values] for s in KIND_BY_NAME[kind].signals if s.values}
    return [
        (name, _writer(name, labels.get(name), 0 if layout.integral[i] else _decimals(layout.factor[i])))
        for i, name in enumerate(layout.signals)
        if name not in HEADER_NAMES
    ]


def _writer(name: str, labels: dict[int, str] | None, decimals: int) -> Callable[[float], str]:
    if labels is not None:
        return lambda value: f"{name}={labels.get(int(value), value)}"
    if name == "contract_hash":
        return lambda value: f"{name}={int(value):08x}"
    return lambda value: f"{name}={value:.{decimals}f}"


def _decimals(step: float) -> int:
    """Digits behind the point that a step needs: 4 for 0.0001, 0 for 250."""
    exponent = Decimal(repr(float(step))).normalize().as_tuple().exponent
    return max(0, -exponent) if isinstance(exponent, int) else 0
