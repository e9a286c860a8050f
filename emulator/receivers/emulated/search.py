"""How receivers choose satellites when left alone.

Each receiver looks at its own antenna only and knows nothing of the others. In every epoch its channels
that obey no command are set on the best satellites by the rule, of those whose signal reaches the antenna,
that are healthy and on none of its commanded channels. A satellite that is no longer among the best is
dropped; one that still is stays on its channel (modelled: receivers differ; RU 2654321 describes the
effect of the first rule, the same satellites in all receivers).

The rule `gdop` chooses a set, not one satellite after another
(`gnss_hil.emulator.receivers.emulated.dilution`). It does so anew every minute, and at once where a channel
is free and a satellite is to be had; in between a receiver keeps what it has, and at the minute too unless
another set is distinctly better (modelled).

A receiver of several signals of a satellite sets a channel on each of them, as far as they arrive, and goes
on to the next satellite with the channels left.

Receivers are oracles here: they know which signals reach their antenna and never search where there is
none, cold ones too. A real receiver searches by almanac and hope, longer and in another order; how long
finding takes is modelled by the times of acquisition alone (`channels.Pace`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.registry import table
from gnss_hil.dbc.common.satellites import system_of
from gnss_hil.emulator.receivers.emulated.channels import NOTHING, Channels
from gnss_hil.emulator.receivers.emulated.dilution import smallest
from gnss_hil.emulator.signal.visibility import View

RENEWAL_NS = 60 * NS_PER_S
"""How often a set of satellites is weighed against others."""


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """What the receivers of a craft choose from.

    index     (n,) satellite index
    eligible  (m, n) healthy satellites whose first signal reaches the antenna, on no commanded channel of it
    alone     (m, k) channels that choose for themselves
    target    (m, k) rows of the sky that all channels are set on now by their first signals
    renews    whether it is time to weigh whole sets
    signals   of a satellite that receivers track at most
    """

    view: View
    index: I64
    eligible: Bool
    alone: Bool
    target: I64
    renews: bool
    signals: int

    @property
    def wanted(self) -> I64:
        """(m,) satellites that each receiver has channels for."""
        return self.alone.sum(axis=1)

    def present(self) -> Bool:
        """(m, n) eligible satellites that a channel is set on by its receiver's own choice."""
        receiver, channel = np.nonzero(self.alone & (self.target >= 0))
        present = np.zeros_like(self.eligible)
        present[receiver, self.target[receiver, channel]] = True
        return present & self.eligible


Best = list[list[int]]
"""Rows of the sky for each receiver, best first."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule of search: what it does, in words, and its choice."""

    name: str
    summary: str
    best: Callable[[Outlook], Best]


def _cheapest(cost: Callable[[View, I64], NDArray[Any]]) -> Callable[[Outlook], Best]:
    """The choice of the satellites of least cost, (n,) or (m, n) by view and satellite index (n,)."""

    def best(outlook: Outlook) -> Best:
        price = np.where(outlook.eligible, cost(outlook.view, outlook.index), np.inf)
        order = np.argsort(price, axis=1, kind="stable")
        number = np.minimum(outlook.wanted, outlook.eligible.sum(axis=1))
        return [row[:k].tolist() for row, k in zip(order, number.tolist(), strict=True)]

    return best


def _least_dilution(outlook: Outlook) -> Best:
    chosen, wanted = outlook.present(), outlook.wanted // outlook.signals
    lacking = chosen.sum(axis=1) < np.minimum(wanted, outlook.eligible.sum(axis=1))
    weighs = lacking | (outlook.renews & (wanted > 0))
    if weighs.any():
        system = system_of(outlook.index)
        chosen[weighs] = smallest(
            outlook.view.los_ecef, system, outlook.eligible[weighs], chosen[weighs], wanted[weighs]
        )
    return [np.flatnonzero(row).tolist() for row in chosen]


RULES = table(
    Rule("elevation", "highest above the horizon first", _cheapest(lambda view, index: -view.sin_elevation)),
    Rule("boresight", "nearest to the antenna's axis first", _cheapest(lambda view, index: view.angle_rad)),
    Rule("prn", "lowest number first, one system after another", _cheapest(lambda view, index: index)),
    Rule("gdop", "the set of smallest dilution, weighed every minute", _least_dilution),
)


def renews(t_ns: int, interval_ns: int) -> bool:
    """Whether sets are weighed in this epoch: the first of each period of GPS time."""
    return t_ns % RENEWAL_NS < interval_ns


def choose(rule: Rule, channels: Channels, eligible: Bool, view: View, index: I64, renews: bool) -> I64:
    """Targets (m, k), columns, after the channels without a command have chosen.

    eligible  (m, c) signals of healthy satellites that reach the antenna
    index     (n,) satellite index
    renews    whether it is time to weigh whole sets
    """
    alone = ~channels.commanded
    if not alone.any():
        return channels.target
    unclaimed, n = _unclaimed(channels, eligible), len(index)
    signals = eligible.shape[1] // n
    firsts = channels.target if signals == 1 else np.where(channels.target < n, channels.target, NOTHING)
    best = rule.best(Outlook(view, index, unclaimed[:, :n], alone, firsts, renews, signals))
    target = channels.target.copy()
    for receiver in np.flatnonzero(alone.any(axis=1)).tolist():
        mine = best[receiver]
        if signals > 1:
            mine = [c for row in mine for c in range(row, eligible.shape[1], n) if unclaimed[receiver, c]]
            del mine[int(alone[receiver].sum()) :]
        _settle(target[receiver], alone[receiver], mine)
    return target


def _unclaimed(channels: Channels, eligible: Bool) -> Bool:
    """Eligible signals that no command has set on a channel of the same receiver."""
    receiver, channel = np.nonzero(channels.commanded & (channels.target >= 0))
    eligible = eligible.copy()
    eligible[receiver, channels.target[receiver, channel]] = False
    return eligible


def _settle(target: I64, alone: Bool, best: list[int]) -> None:
    """Set one receiver's free channels (k,) in place: keep who stays, drop who went, add who came."""
    free = []
    missing = dict.fromkeys(best)
    for channel in np.flatnonzero(alone).tolist():
        if int(target[channel]) in missing:
            del missing[int(target[channel])]
        else:
            target[channel] = NOTHING
            free.append(channel)
    for channel, row in zip(free, missing, strict=False):
        target[channel] = row
