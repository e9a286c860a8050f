"""A second reader of bus.log for tests: cantools and plain Python, nothing of the project's codec,
flight software or tables."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import cantools

_LINE = re.compile(r"\((\d+\.\d+)\) (\S+) ([0-9A-F]{3})#([0-9A-F]{0,16})")
_BIAS = {"GPS": "G", "GLONASS": "R"}


@dataclass
class Epoch:
    """Everything one epoch carried, by message; receivers are 1-based."""

    number: int
    signals: dict[str, dict] = field(default_factory=dict)  # messages that come once
    channels: dict[tuple[int, int], dict] = field(default_factory=lambda: defaultdict(dict))
    commands: list[tuple[int, dict]] = field(default_factory=list)
    acks: list[tuple[int, dict]] = field(default_factory=list)
    almanac: dict[str, dict] = field(default_factory=lambda: defaultdict(dict))
    used: dict[int, int] = field(default_factory=dict)

    def satellite(self, receiver: int, channel: int) -> str:
        return sat_name(self.channels[receiver, channel])


def sat_name(signals: dict) -> str:
    return f"{_BIAS[str(signals['sat_system'])]}{signals['sat_number']:02d}"


def read(path: Path, dbc: Path) -> list[Epoch]:
    """The epochs of a log, decoded message by message with cantools."""
    database = cantools.database.load_file(dbc)
    by_id = {m.frame_id: m for m in database.messages}
    epochs: list[Epoch] = []
    with open(path) as log:
        for line in log:
            match = _LINE.fullmatch(line.strip())
            assert match, line
            message = by_id[int(match[3], 16)]
            signals = message.decode(bytes.fromhex(match[4]))
            if message.name == "TIME_MARK":
                epochs.append(Epoch(signals["epoch"]))
            _file(epochs[-1], message.name, signals)
    return epochs


def _file(epoch: Epoch, name: str, signals: dict) -> None:
    assert signals["epoch_mod16"] == epoch.number % 16, name
    receiver = re.match(r"RX(\d)_(.*)", name)
    if receiver is None:
        if name == "NAV_USED":
            epoch.used[signals["receiver"]] = signals["channels"]
        elif name not in ("NAV_CLOCK", "NAV_DRIFT"):
            epoch.signals[name] = signals
        return
    number, kind = int(receiver[1]), receiver[2]
    if kind == "COMMAND":
        epoch.commands.append((number, signals))
    elif kind == "ACK":
        epoch.acks.append((number, signals))
    elif kind.startswith("ALM_"):
        row = epoch.almanac[sat_name(signals)]
        row.update({f"{k}": v for k, v in signals.items()})
    elif "channel" in signals:
        epoch.channels[number, signals["channel"]].update(signals)
