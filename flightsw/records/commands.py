"""Channel commands."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import I64


@dataclass(frozen=True, slots=True, eq=False)
class Commands:
    """Commands of one epoch, each (n,) int: 0-based antenna and channel, action, satellite index and signal
    number, transaction."""

    antenna: I64
    channel: I64
    action: I64
    sat: I64
    signal: I64
    transaction: I64

    def __len__(self) -> int:
        return len(self.sat)
