"""Steps 6 to 9 of RU 2706636 C1: each satellite is tracked by the one antenna it is nearest the axis of.

Where the patent is silent or speaks twice:

- mask (step 9): the description's "until its angle exceeds the mask of the antenna" (`antenna`, default) or
  claim 1's "while the angles to the axes of all receiving antennas are below the mask" (`all`).
- more satellites than channels: the smallest angles stay and the others are not tracked (`drop`, the literal
  "antenna and satellite for which this angle is smallest of all the measured angles"), or go on to their
  next-best antenna with a free channel (`next`).
- ties: the lower antenna, then the lower satellite index.
- hysteresis: none in the patent, hence 0 deg. Otherwise the angle to the antenna that has the satellite
  counts `hysteresis_deg` less, both between antennas and between satellites that compete for a channel.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.flightsw.assignment.options import AssignmentOptions


class NearestBoresightOptions(AssignmentOptions):
    mask_reading: Annotated[Literal["antenna", "all"], Field(description="whose mask ends tracking")] = (
        "antenna"
    )
    overflow: Annotated[
        Literal["drop", "next"], Field(description="what becomes of satellites beyond an antenna's channels")
    ] = "drop"
    hysteresis_deg: Annotated[float, Field(ge=0, le=30, description="advantage of the present antenna")] = 0.0


def assign(
    angles_rad: F64,
    mask_rad: F64,
    channels: I64,
    previous: I64,
    options: NearestBoresightOptions,
) -> I64:
    """The antenna of each visible satellite, (n,) int64, -1 for none.

    angles_rad  (m, n) between boresights and satellites, satellites in the order of their index
    mask_rad    (m,) largest angle off boresight
    channels    (m,) of each antenna: the satellites that it has room for
    previous    (n,) antenna that has the satellite now, -1 none
    """
    below = angles_rad < mask_rad[:, None]
    if options.mask_reading == "all":
        below = below & below.all(axis=0)
    cost = angles_rad
    if options.hysteresis_deg:
        mine = previous == np.arange(len(mask_rad))[:, None]
        cost = angles_rad - np.deg2rad(options.hysteresis_deg) * (mine & below)
    if options.overflow == "drop":
        below = below & (np.arange(len(mask_rad))[:, None] == cost.argmin(axis=0))
    return _by_angle(cost, below, channels)


def _by_angle(cost: F64, allowed: Bool, channels: I64) -> I64:
    """Allowed pairs (m, n) by angle: one is taken while its satellite and a channel of its antenna are free.

    Satellites and antennas rank each other by the same angle, so this is their one stable matching. Where
    only the nearest antenna of each satellite is allowed, each antenna keeps its nearest satellites.
    """
    antenna, satellite = allowed.nonzero()
    order = cost[allowed].argsort(kind="stable")
    chosen, free = [-1] * cost.shape[1], channels.tolist()
    for a, i in zip(antenna[order].tolist(), satellite[order].tolist(), strict=True):
        if free[a] and chosen[i] < 0:
            chosen[i] = a
            free[a] -= 1
    return np.array(chosen, np.int64)
