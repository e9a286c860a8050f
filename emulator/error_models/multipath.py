"""Single reflections from the craft's structure through the correlators."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.emulator.error_models.base import Context, ErrorModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params_structure import Multipath
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    params: Multipath
    spacing_chips: float

    leads = True

    @property
    def reaches(self) -> bool:
        return self.params.hold_reflections

    def path(self, at: ChannelGeometry) -> PathTerm:
        signals = at.receiver, at.row, np.where(at.hidden, 0.0, 1.0), at.wave_m, at.chip_m
        found = at.epochs.structure.receive(self.params, self.spacing_chips, at.antennas, at.at, signals)
        return PathTerm(found.range_m, found.phase_m, found.rate_mps, level_db=found.level_db)


def build(params: Multipath, context: Context) -> ErrorModel:
    return Model(params, context.loops.correlator_spacing_chips)


ROW = Row(
    "multipath",
    Multipath,
    Stage.PATH,
    "van Nee, IEEE Trans. AES 29 (1993) 1359; Kaplan & Hegarty, 3rd ed., 9.5",
    build,
    needs=frozenset({"structure"}),
)
