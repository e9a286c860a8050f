"""Channel geometry: signals between satellites and antennas, one row for each pair and epoch of a block."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.signal.antenna_patterns import Receive
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry
from gnss_hil.emulator.signal.geometry import Path


@dataclass(frozen=True, slots=True, eq=False)
class ChannelGeometry:
    """p signals, each in one epoch of a block.

    epochs    of the whole block;  at (p,) which of its epochs
    receiver  (p,) 0-based;  row (p,) of the sky;  sat, system (p,) satellite index and its system
    signal    (p,) value of the contract's table "Signal"
    wave_m, chip_m   (p,) lengths of carrier wave and code chip [m]
    cn0_dbhz  (p,) carrier to noise density
    path      from transmission to reception
    hidden    (p,) whether the craft's structure is in the way of the direct ray
    antennas  patterns of the receiving antennas
    """

    epochs: EpochGeometry
    at: I64
    receiver: I64
    row: I64
    sat: I64
    system: I64
    signal: I64
    wave_m: F64
    chip_m: F64
    cn0_dbhz: F64
    path: Path
    hidden: Bool
    antennas: Receive

    def __len__(self) -> int:
        return len(self.row)

    @property
    def epoch(self) -> I64:
        """(p,) number of the epoch in the run."""
        return self.epochs.epoch[self.at]
