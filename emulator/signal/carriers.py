"""Which signals of which satellites the receivers of a craft can track, each on a channel of its own.

A signal has a *rank* among those of its system: 0 is the system's first, which every receiver tracks; the
others are what the vehicle file names. A satellite and a signal together are a *column* of the arrays over
what channels may be set on, `rank * n + row` with n satellites of the sky: where receivers track one signal
of each system, columns are rows of the sky.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.signal.bands import FIRST_SIGNAL
from gnss_hil.emulator.signal.powers import POWERS


@dataclass(frozen=True, slots=True, eq=False)
class Carriers:
    """Signals that m receivers can track, by rank r.

    signal    (r, 8) value on the bus by system, -1 none
    rank_of   (16,) rank of each signal, -1 of those that no receiver tracks
    reaches   (r, m, 512) whether a receiver can track a signal of a satellite: it is built for it, and the
              satellite sends it
    """

    signal: I64
    rank_of: I64
    reaches: Bool

    @property
    def ranks(self) -> int:
        return len(self.signal)

    def place(self, column: I64, n: int) -> tuple[I64, I64]:
        """Ranks and rows of the sky (p,) of columns (p,), n satellites of the sky."""
        if self.ranks == 1:
            return np.zeros_like(column), column
        rank, row = np.divmod(column, n)
        return rank, row

    def tracks(self, signal: I64, receiver: I64, sat: I64) -> Bool:
        """(c,) whether receivers can track signals, by their values, of satellite indices."""
        rank, system = self.rank_of[signal], satellites.system_of(sat)
        return (rank >= 0) & (self.signal[rank, system] == signal) & self.reaches[rank, receiver, sat]


def carriers(others: Sequence[Sequence[str]], sent: Bool) -> Carriers:
    """What receivers can track; ValueError with one line for a signal that emulated satellites do not send.

    others  (m,) names of each receiver's signals beside the systems' first
    sent    (16, 512) whether satellites send signals, `block_types.sent_signals`
    """
    wanted = {name for names in others for name in names}
    if unknown := sorted(wanted - POWERS.keys()):
        known = ", ".join(name for name in POWERS if signals.beyond_first()[SIGNALS[name].value])
        raise ValueError(f"signal {unknown[0]} is sent by no emulated satellite; there are {known}")
    ranked: dict[int, list[int]] = {s.value: [int(FIRST_SIGNAL[s.value])] for s in SYSTEMS.values()}
    for signal in SIGNALS.values():
        if signal.name in wanted:
            ranked[SYSTEMS[signal.system].value].append(signal.value)
    ranks = max(len(values) for values in ranked.values())
    table = np.full((ranks, systems.COUNT), -1)
    for system, values in ranked.items():
        table[: len(values), system] = values
    rank_of = np.full(signals.COUNT, -1)
    for rank, values in enumerate(table):
        rank_of[values[values >= 0]] = rank
    built = np.array([[name in names for names in others] for name in SIGNALS])
    system = satellites.system_of(np.arange(satellites.SATELLITES))
    reaches = np.ones((ranks, len(others), satellites.SATELLITES), bool)
    for signal, receivers in zip(SIGNALS.values(), built, strict=True):
        if (rank := rank_of[signal.value]) > 0:
            of_system = system == SYSTEMS[signal.system].value
            reaches[rank][:, of_system] = receivers[:, None] & sent[signal.value, of_system]
    for rank in range(1, ranks):
        reaches[rank][:, table[rank, system] < 0] = False
    return Carriers(table, rank_of, reaches)
