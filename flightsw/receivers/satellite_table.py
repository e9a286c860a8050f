"""All satellites as the channel manager sees them: where each may be tracked, and its handovers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.flightsw.receivers.channel_table import NEVER


@dataclass(frozen=True, slots=True, eq=False)
class SatelliteTable:
    """(SATELLITES,) arrays.

    permitted      antenna each satellite is permitted on, -1 none
    blocked_until  epoch until which a refused satellite is left alone
    moving         in handover: permitted on another antenna, not yet in a fix from it
    used_epoch     when it was last in a fix
    """

    permitted: I64
    blocked_until: I64
    moving: Bool
    used_epoch: I64

    def refused(self, sat: I64, until_epoch: int) -> SatelliteTable:
        """With satellites (n,) that are left alone until an epoch."""
        blocked = self.blocked_until.copy()
        blocked[sat] = until_epoch
        return replace(self, blocked_until=blocked)

    def permitted_on(self, permitted: I64) -> SatelliteTable:
        """With other permissions: what the last fixes used and another antenna gets is in handover."""
        in_use = self.used_epoch >= max(self.used_epoch.max() - 1, 0)
        moved = in_use & (self.permitted >= 0) & (self.permitted != permitted)
        return replace(self, permitted=permitted, moving=(self.moving | moved) & (permitted >= 0))

    def released(self) -> SatelliteTable:
        """Permitted nowhere, hence in no handover."""
        nowhere = np.full(SATELLITES, -1, np.int64)
        return replace(self, permitted=nowhere, moving=np.zeros(SATELLITES, bool))

    def in_fix(self, sat: I64, epoch: int) -> tuple[SatelliteTable, I64]:
        """After a fix with satellites (n,): handovers completed, and their gaps (h,) in epochs."""
        used_epoch = self.used_epoch.copy()
        used_epoch[sat] = epoch
        done = sat[self.moving[sat]]
        if not len(done):
            return replace(self, used_epoch=used_epoch), done
        moving = self.moving.copy()
        moving[done] = False
        return replace(self, moving=moving, used_epoch=used_epoch), epoch - self.used_epoch[done] - 1


def untouched() -> SatelliteTable:
    """Nothing permitted, nothing used yet."""
    never = np.full(SATELLITES, NEVER, np.int64)
    return SatelliteTable(np.full(SATELLITES, -1, np.int64), never, np.zeros(SATELLITES, bool), never)
