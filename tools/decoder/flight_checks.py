"""What the flight software says of its own checks: what it refused and why, and what it left out of a fix.

`NAV_REFUSED` names reason and identifier. `NAV_STATUS` says how many satellites and receivers were left out
because they contradict the others, and not which: those that delivered what a fix may be made of, and are not
in it. Where these are as many as it says they are named.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64, Bool, Index
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.tools.decoder.block import Block, Columns
from gnss_hil.tools.decoder.channels import Channels

UNNAMED = -1
"""Which one was left out cannot be told."""

_FULL, _HEALTHY = raw_of("Lock")["FULL"], raw_of("Health")["HEALTHY"]
_PREDICTED = -15, 14
"""Accuracy indices with a prediction behind them (IS-GPS-200, 20.3.3.3.1.3)."""


def refusals_said(block: Block) -> Columns:
    """epoch (row of the block), ahead, reason (raw), identifier, count, (k,) each, of every NAV_REFUSED.

    Without a time that it believes the flight software answers under the epoch of the last one: of several
    answers to an epoch each is of one epoch more, which `ahead` counts. Those that refuse come last.
    """
    said = block["NAV_REFUSED"]
    columns = {name: said[name].astype(np.int64) for name in ("reason", "identifier", "count")}
    answers = np.bincount(block["NAV_STATUS"].epoch, minlength=block.epochs)
    begins = (said["slot"] == 0).astype(np.int64)
    refusing = np.bincount(said.epoch, begins, minlength=block.epochs).astype(np.int64)
    before = np.cumsum(refusing) - refusing
    turn = np.cumsum(begins) - before[said.epoch] + answers[said.epoch] - refusing[said.epoch] - 1
    return {"epoch": said.epoch, "ahead": np.maximum(turn, 0), **columns}


LACKS = ("without_time", "without_attitude", "attitude_held", "unheeded")
"""What the flight software says in NAV_STATE that it does without."""


def lacks_said(block: Block) -> Columns:
    """epoch (row of the block), which (place in `LACKS`), (k,) each."""
    flags = np.stack([block.grid("NAV_STATE", name, 0) for name in LACKS], axis=1) > 0
    epoch, which = flags.nonzero()
    return {"epoch": epoch, "which": which}


def left_out(channels: Channels, used: Bool, told: Bool, fix: Columns) -> Columns:
    """epoch (row of the block), receiver (whether it is one), which (satellite index, or 0-based number;
    UNNAMED), count, (k,) each.

    channels, used (n,)   what was measured, and whether it is in the fix
    told (e,)   whether the flight software says what is in it;  fix (e,)  as `navigation.fixes`
    """
    rows = list(_left_out(channels, used, told, fix))
    return dict(
        zip(("epoch", "receiver", "which", "count"), np.array(rows, np.int64).reshape(-1, 4).T, strict=True)
    )


def _left_out(
    channels: Channels, used: Bool, told: Bool, fix: Columns
) -> Iterator[tuple[int, bool, int, int]]:
    of_satellites, of_receivers = (
        np.where(fix["valid"], np.nan_to_num(fix[f"excluded_{what}"]), 0).astype(np.int64)
        for what in ("satellites", "receivers")
    )
    fit = _fit_for_a_fix(channels)
    for epoch in np.flatnonzero(of_satellites + of_receivers).tolist():
        here = slice(*np.searchsorted(channels.epoch, (epoch, epoch + 1)).tolist())
        for is_receiver, said, of in (
            (False, int(of_satellites[epoch]), channels.sat[here]),
            (True, int(of_receivers[epoch]), channels.receiver[here]),
        ):
            named = _not_in(of, fit[here], used[here])
            if told[epoch] and len(named) == said:
                yield from ((epoch, is_receiver, which, 1) for which in named.tolist())
            elif said:
                yield epoch, is_receiver, UNNAMED, said


def _fit_for_a_fix(channels: Channels) -> Bool:
    """(n,) channels that satellites and loops give no reason to leave out."""
    best, worst = _PREDICTED
    of = channels.values
    return (of["lock"] == _FULL) & (of["health"] == _HEALTHY) & (of["ura"] >= best) & (of["ura"] <= worst)


def _not_in(of: Index, fit: Bool, used: Bool) -> I64:
    """Satellites or receivers that have rows which are fit and none in the fix, ascending."""
    return np.setdiff1d(of[fit], of[used])


def names_of(out: Columns) -> NDArray[np.str_]:
    """(k,) names of what was left out, as `left_out` has it: G07, RX2; "" where it cannot be told which."""
    pairs = zip(out["receiver"].tolist(), out["which"].tolist(), strict=True)
    return np.array([_name(bool(is_receiver), which) for is_receiver, which in pairs], "U8")


def _name(is_receiver: bool, which: int) -> str:
    if which == UNNAMED:
        return ""
    return f"RX{which + 1}" if is_receiver else satellites.name(which)


def named(out: Columns, epochs: int) -> NDArray[np.object_]:
    """(epochs,) names of what was left out of each epoch's fix, with blanks between them."""
    found = [""] * epochs
    for epoch, name in zip(out["epoch"].tolist(), names_of(out).tolist(), strict=True):
        found[epoch] = f"{found[epoch]} {name}".strip()
    return np.array(found, object)
