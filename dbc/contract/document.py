"""Write the message map of the contract as Markdown.

python -m gnss_hil.dbc.contract.document > docs/messages.md
"""

from __future__ import annotations

import sys

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.layout import Kind, Signal
from gnss_hil.dbc.contract.messages import KINDS
from gnss_hil.dbc.contract.values import VALUES


def _identifiers(kind: Kind) -> str:
    if kind.per == "receiver":
        last = kind.base + kind.stride * (MAX_RECEIVERS - 1)
        return f"0x{kind.base:03X} + 0x{kind.stride:02X} (r - 1), r = 1..8 (to 0x{last:03X})"
    if kind.per == "node":
        return f"0x{kind.base - 1:03X} + node number"
    return f"0x{kind.base:03X}"


def _range(s: Signal) -> str:
    low, high = (f"{raw * s.factor + s.offset:.10g}" for raw in s.raw_range)
    return f"{low} .. {high}"


def _signal_row(s: Signal) -> str:
    sign = "signed" if s.signed else "unsigned"
    meaning = f"{s.comment} ({s.values})" if s.values else s.comment
    cells = (f"`{s.name}`", s.start, s.bits, sign, f"{s.factor:.10g}", s.unit, _range(s), meaning)
    return "| " + " | ".join(map(str, cells)) + " |"


def _section(kind: Kind) -> str:
    key = f"identifier and `{kind.key}`" if kind.key else "identifier"
    head = {
        "Identifier": _identifiers(kind),
        "Sender": kind.sender.replace("RX", "receiver r"),
        "Sent": {"epoch": "every epoch", "bulk": "a slice every epoch", "event": "when needed"}[kind.cycle],
        "Protected stream": key,
    }
    return "\n".join(
        [
            f"### {kind.name}",
            "",
            kind.comment,
            "",
            *(f"- {name}: {value}" for name, value in head.items()),
            "",
            "| signal | start bit | bits | | step | unit | range | meaning |",
            "|---|---|---|---|---|---|---|---|",
            *(_signal_row(s) for s in kind.signals[3:]),
        ]
    )


def document() -> str:
    """The message map, Markdown."""
    hashes = "\n".join(f"| {m} | `0x{codec(m).hash:08X}` |" for m in range(1, MAX_RECEIVERS + 1))
    values = "\n".join(
        f"| {name} | " + ", ".join(f"{raw} {label}" for raw, label in table.items()) + " |"
        for name, table in VALUES.items()
    )
    sections = "\n\n".join(_section(kind) for kind in KINDS)
    return f"""# Message map

Written by `python -m gnss_hil.dbc.contract.document` from the contract; conventions:
[contract.md](contract.md).
All signals are little-endian (Intel); start bit 0 is the lowest bit of byte 0. All carry
`e2e_crc` (bits 0-7), `e2e_counter` (8-11) and `epoch_mod16` (12-15) before the signals listed. Kinds that
repeat per receiver or node are named after their sender in the DBC: `RX1_RANGE`, `ATT_HEARTBEAT`.

## Contract hash

First four bytes, big-endian, of the SHA-256 of the DBC file, as heartbeats carry it.

| receivers | hash |
|---|---|
{hashes}

## Value tables

| table | values |
|---|---|
{values}

## Messages

{sections}
"""


if __name__ == "__main__":
    sys.stdout.write(document())
