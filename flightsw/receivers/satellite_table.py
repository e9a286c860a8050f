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
    second         signal it is tracked by there beside its first, on a channel more; 0 none
    blocked_until  epoch until which a refused satellite is left alone
    single_until   epoch until which it is tracked by its first signal only: its second was refused
    moving         in handover: permitted on another antenna, not yet in a fix from it
    used_epoch     when it was last in a fix
    """

    permitted: I64
    second: I64
    blocked_until: I64
    single_until: I64
    moving: Bool
    used_epoch: I64

    def refused(self, sat: I64, until_epoch: int) -> SatelliteTable:
        """With satellites (n,) that are left alone until an epoch."""
        blocked = self.blocked_until.copy()
        blocked[sat] = until_epoch
        return replace(self, blocked_until=blocked)

    def without_second(self, sat: I64, until_epoch: I64) -> SatelliteTable:
        """With satellites (n,) that are tracked by their first signal only until epochs (n,)."""
        single = self.single_until.copy()
        single[sat] = until_epoch
        return replace(self, single_until=single)

    def permitted_on(self, permitted: I64, second: I64) -> SatelliteTable:
        """With other permissions: what the last fixes used and another antenna gets is in handover. A pair of
        signals is handed over as one."""
        in_use = self.used_epoch >= max(self.used_epoch.max() - 1, 0)
        moved = in_use & (self.permitted >= 0) & (self.permitted != permitted)
        moving = (self.moving | moved) & (permitted >= 0)
        return replace(self, permitted=permitted, second=second, moving=moving)

    def released(self) -> SatelliteTable:
        """Permitted nowhere, hence in no handover."""
        nowhere = np.full(SATELLITES, -1, np.int64)
        none = np.zeros(SATELLITES, np.int64)
        return replace(self, permitted=nowhere, second=none, moving=np.zeros(SATELLITES, bool))

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
    none, nowhere = np.zeros(SATELLITES, np.int64), np.full(SATELLITES, -1, np.int64)
    return SatelliteTable(nowhere, none, never, never, np.zeros(SATELLITES, bool), never)
