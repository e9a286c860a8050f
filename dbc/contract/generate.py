"""Write the DBC file of the contract.

python -m gnss_hil.dbc.contract.generate --receivers 4 > dbc/contract/gnss.dbc
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace
from decimal import Decimal

from gnss_hil.dbc.common.limits import CHANNELS
from gnss_hil.dbc.contract.layout import Signal
from gnss_hil.dbc.contract.messages import BIT_RATE, Message, messages, node_names
from gnss_hil.dbc.contract.values import VALUES

CHANNEL_KEY = "channel"
"""Signal by which messages of channels are told apart."""

_NEW_SYMBOLS = (
    "NS_DESC_ CM_ BA_DEF_ BA_ VAL_ CAT_DEF_ CAT_ FILTER BA_DEF_DEF_ EV_DATA_ ENVVAR_DATA_ SGTYPE_ "
    "SGTYPE_VAL_ BA_DEF_SGTYPE_ BA_SGTYPE_ SIG_TYPE_REF_ VAL_TABLE_ SIG_GROUP_ SIG_VALTYPE_ "
    "SIGTYPE_VALTYPE_ BO_TX_BU_ BA_DEF_REL_ BA_REL_ BA_DEF_DEF_REL_ BU_SG_REL_ BU_EV_REL_ BU_BO_REL_ "
    "SG_MUL_VAL_"
).split()

_SEND_TYPES = ("Cyclic", "Event")

_DEFINITIONS = f"""\
BA_DEF_ "BusType" STRING ;
BA_DEF_ "Baudrate" INT 0 1000000;
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_ BO_ "GenMsgSendType" ENUM {",".join(f'"{t}"' for t in _SEND_TYPES)};
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN";
BA_DEF_ BO_ "E2EProfile" STRING ;
BA_DEF_ BO_ "E2EDataID" INT 0 65535;
BA_DEF_ BO_ "E2EStreamKey" STRING ;
BA_DEF_ SG_ "GenSigStartValue" INT 0 2147483647;
BA_DEF_DEF_ "BusType" "CAN";
BA_DEF_DEF_ "Baudrate" {BIT_RATE};
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_DEF_DEF_ "GenMsgSendType" "Cyclic";
BA_DEF_DEF_ "VFrameFormat" "StandardCAN";
BA_DEF_DEF_ "E2EProfile" "";
BA_DEF_DEF_ "E2EDataID" 0;
BA_DEF_DEF_ "E2EStreamKey" "";
BA_DEF_DEF_ "GenSigStartValue" 0;
BA_ "BusType" "CAN";
BA_ "Baudrate" {BIT_RATE};"""

_CYCLE_MS = {"epoch": 1000, "bulk": 1000, "event": 0}


def _number(value: float) -> str:
    """Shortest exact decimal without an exponent, so that every reader sees the same factor."""
    text = format(Decimal(repr(value)), "f")
    return text.removesuffix(".0")


@dataclass(frozen=True, slots=True)
class Placed:
    """A signal of a message in the file; `switch`: '', or 'M' of the multiplexer, or 'm3' of what is in the
    frame where the multiplexer is 3."""

    signal: Signal
    switch: str = ""


def _plain(m: Message) -> list[Placed]:
    return [Placed(s) for s in m.kind.signals]


def _by_channel(m: Message) -> list[Placed]:
    """With a signal for each channel: `range_ch03`, where the plain file has `channel` and `range`."""
    if m.kind.key != CHANNEL_KEY:
        return _plain(m)
    names = [s.name for s in m.kind.signals]
    shared = names.index(CHANNEL_KEY)  # what stands before it protects the frame, whichever channel it is of
    head = [Placed(s, "M" if s.name == CHANNEL_KEY else "") for s in m.kind.signals[: shared + 1]]
    return head + [
        Placed(replace(s, name=f"{s.name}_ch{channel:02d}"), f"m{channel}")
        for channel in range(CHANNELS)
        for s in m.kind.signals[shared + 1 :]
    ]


def _signal_line(placed: Placed, receivers: tuple[str, ...]) -> str:
    s, switch = placed.signal, placed.switch and f" {placed.switch}"
    low, high = (_number(round(raw * s.factor + s.offset, 9)) for raw in s.raw_range)
    sign = "-" if s.signed else "+"
    return (
        f" SG_ {s.name}{switch} : {s.start}|{s.bits}@1{sign} ({_number(s.factor)},{_number(s.offset)})"
        f' [{low}|{high}] "{s.unit}" {",".join(receivers)}'
    )


def _message_block(m: Message, placed: list[Placed]) -> str:
    return "\n".join(
        [f"BO_ {m.can_id} {m.name}: 8 {m.sender}", *(_signal_line(each, m.receivers) for each in placed)]
    )


def _value_list(table: str) -> str:
    return " ".join(f'{raw} "{label}"' for raw, label in VALUES[table].items())


def _attributes(m: Message) -> list[str]:
    rows = [
        ("GenMsgCycleTime", _CYCLE_MS[m.kind.cycle]),
        ("GenMsgSendType", _SEND_TYPES.index("Event" if m.kind.cycle == "event" else "Cyclic")),
        ("VFrameFormat", 0),
        ("E2EProfile", '"P11A"'),
        ("E2EDataID", m.can_id),
        ("E2EStreamKey", f'"{m.kind.key}"'),
    ]
    return [f'BA_ "{name}" BO_ {m.can_id} {value};' for name, value in rows]


_PER_CHANNEL = (
    ". A signal for each channel: a variant, of the same frames, for programs that plot signals. The "
    "contract, and its hash, are those of the file without --per-channel"
)


def dbc_text(receivers: int = 4, per_channel: bool = False) -> str:
    """The DBC file, ASCII, for 1 to 8 receivers.

    per_channel  the messages of channels are multiplexed by `channel`, so that each channel has signals of
                 its own; it describes the same frames and is not what the contract's hash is of
    """
    every = list(messages(receivers))
    placed = [(_by_channel if per_channel else _plain)(m) for m in every]
    signals = [(m, each.signal) for m, among in zip(every, placed, strict=True) for each in among]
    variant = _PER_CHANNEL if per_channel else ""
    parts = [
        'VERSION ""',
        "NS_ :\n" + "\n".join(f"\t{symbol}" for symbol in _NEW_SYMBOLS),
        "BS_:",
        "BU_: " + " ".join(node_names(receivers)),
        "\n".join(f"VAL_TABLE_ {name} {_value_list(name)} ;" for name in VALUES),
        "\n\n".join(_message_block(m, among) for m, among in zip(every, placed, strict=True)),
        "\n".join(
            [f'CM_ "gnss-hil bus contract, {receivers} receivers. Conventions: docs/contract.md{variant}";']
            + [f'CM_ BO_ {m.can_id} "{m.kind.comment}";' for m in every]
            + [f'CM_ SG_ {m.can_id} {s.name} "{s.comment}";' for m, s in signals]
        ),
        _DEFINITIONS,
        "\n".join(row for m in every for row in _attributes(m)),
        "\n".join(f'BA_ "GenSigStartValue" SG_ {m.can_id} {s.name} 0;' for m, s in signals),
        "\n".join(f"VAL_ {m.can_id} {s.name} {_value_list(s.values)} ;" for m, s in signals if s.values),
    ]
    text = "\n\n".join(parts) + "\n"
    text.encode("ascii")
    return text


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m gnss_hil.dbc.contract.generate", description=__doc__)
    parser.add_argument("--receivers", type=int, default=4, choices=range(1, 9), help="receivers on the bus")
    sys.stdout.write(dbc_text(parser.parse_args(argv).receivers))


if __name__ == "__main__":
    main()
