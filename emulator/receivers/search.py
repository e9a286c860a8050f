"""How receivers choose satellites when left alone.

Each receiver looks at its own antenna only and knows nothing of the others. In every epoch its channels
that obey no command are set on the best satellites by the rule, of those whose signal reaches the antenna,
that are healthy and on none of its commanded channels. A satellite that is no longer among the best is
dropped; one that still is stays on its channel (modelled: receivers differ; RU 2654321 describes the
effect of the first rule, the same satellites in all receivers).

Receivers are oracles here: they know which signals reach their antenna and never search where there is
none, cold ones too. A real receiver searches by almanac and hope, longer and in another order; how long
finding takes is modelled by the times of acquisition alone (`channels.Pace`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc.registry import table
from emulator.receivers.channels import NOTHING, Channels, Flags, Numbers
from emulator.signals.view import View


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule of search: what it says, and its cost (m, n) from view and satellite index (n,); least first."""

    name: str
    says: str
    cost: Callable[[View, Numbers], NDArray[np.float64]]


def _by_satellite(values, view: View):
    return np.broadcast_to(values, view.angle_rad.shape)


RULES = table(
    Rule("elevation", "highest above the horizon first", lambda v, i: _by_satellite(-v.sin_elevation, v)),
    Rule("boresight", "nearest to the antenna's axis first", lambda v, i: v.angle_rad),
    Rule("prn", "lowest number first, GPS before GLONASS", lambda v, i: _by_satellite(i, v)),
)


def choose(rule: Rule, channels: Channels, eligible: Flags, view: View, index: Numbers) -> Numbers:
    """Targets (m, k) after the channels without a command have chosen.

    eligible  (m, n) healthy satellites whose signal reaches the antenna
    index     (n,) satellite index
    """
    alone = ~channels.commanded
    if not alone.any():
        return channels.target
    best = _best(rule.cost(view, index), _unclaimed(channels, eligible), alone.sum(axis=1))
    target = channels.target.copy()
    for receiver in np.flatnonzero(alone.any(axis=1)).tolist():
        _settle(target[receiver], alone[receiver], best[receiver])
    return target


def _unclaimed(channels: Channels, eligible: Flags) -> Flags:
    """Eligible satellites that no command has set on a channel of the same receiver."""
    receiver, channel = np.nonzero(channels.commanded & (channels.target >= 0))
    eligible = eligible.copy()
    eligible[receiver, channels.target[receiver, channel]] = False
    return eligible


def _best(cost, eligible: Flags, wanted: Numbers) -> list[list[int]]:
    """Rows of the `wanted` (m,) cheapest eligible satellites of each receiver, best first."""
    order = np.argsort(np.where(eligible, cost, np.inf), axis=1, kind="stable")
    number = np.minimum(wanted, eligible.sum(axis=1))
    return [row[:k].tolist() for row, k in zip(order, number.tolist(), strict=True)]


def _settle(target: Numbers, alone: Flags, best: list[int]) -> None:
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
