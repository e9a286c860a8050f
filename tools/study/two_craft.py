"""Two craft side by side, played inline: what their fixes are off, and which measurements they used.

Fixes and measurements are those of the frames, as any flight software would be judged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.emulator.journal import FaultLog
from gnss_hil.tools.decoder.digest import Columns, Digest
from gnss_hil.tools.live.progress import Progress
from gnss_hil.tools.processes import inline
from gnss_hil.tools.recording.recorder import Recorder
from gnss_hil.tools.run_config.plan import Plan


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Errors of the fixes of two craft over e epochs, nan where there is none.

    t_s         (e,) since the first epoch [s]
    position_m  (2, e, 3) fix minus truth, ECEF
    velocity_mps  (2, e, 3)
    alike       (e,) whether both fixes are of the same satellites on the same antennas
    """

    t_s: F64
    position_m: F64
    velocity_mps: F64
    alike: Bool

    @property
    def difference_m(self) -> F64:
        """(e, 3) error of the relative position: the first craft's less the second's."""
        return self.position_m[0] - self.position_m[1]


class _Craft:
    """The digest of one craft's bus, and the measurements in its fixes."""

    def __init__(self, codec: Codec):
        self._used: list[tuple[I64, I64]] = []
        self.digest = Digest(codec, self._take)

    def _take(self, channels: Columns) -> None:
        used = channels["used"]
        measured = channels["receiver"] * SATELLITES + channels["sat"]
        self._used.append((channels["t_ns"][used], measured[used]))

    def used(self, t_ns: I64) -> set[tuple[int, int]]:
        """Row of an epoch (e,) and number of an antenna and satellite, for each measurement in a fix."""
        pairs: set[tuple[int, int]] = set()
        for at_ns, measured in self._used:
            pairs |= set(zip(np.searchsorted(t_ns, at_ns).tolist(), measured.tolist(), strict=True))
        return pairs

    def errors(self, t_ns: I64, truth: NDArray) -> tuple[F64, F64, Bool]:
        """Errors (e, 3) of position and velocity, nan where there is no fix; (e,) where there is one."""
        fixes = self.digest.fixes
        valid = fixes["valid"]
        row = np.searchsorted(t_ns, fixes["t_ns"][valid])
        position, velocity = np.full((2, len(t_ns), 3), np.nan)
        position[row] = np.column_stack([fixes[f"{axis}_m"][valid] for axis in "xyz"])
        velocity[row] = np.column_stack([fixes[f"v{axis}_mps"][valid] for axis in "xyz"])
        fixed: Bool = np.isfinite(position.sum(axis=1))
        return position - truth["position_ecef_m"], velocity - truth["velocity_ecef_mps"], fixed


class _Truth:
    """Rows of truth as they come."""

    def __init__(self):
        self.rows: list[NDArray] = []

    def add(self, rows: NDArray, now_s: float) -> None:
        self.rows.append(rows)


def play(plan: Plan) -> Errors:
    """All epochs of a plan of two craft."""
    time = plan.scenario.time
    craft = [_Craft(codec) for codec in plan.codecs]
    recorder = Recorder(
        dict(zip(plan.names, plan.codecs, strict=True)), time.start_ns, time.interval_ns, None,
        lambda bus, frames, bits: craft[bus].digest.feed(frames, bits),
    )  # fmt: skip
    truth = _Truth()
    inline.play(plan, recorder, truth, FaultLog(None, ()), Progress(plan, quiet=True), lambda: False)
    recorder.flush()
    for one in craft:
        one.digest.finish()
    rows = np.stack(truth.rows, axis=1)  # (2, e)
    t_ns = rows["t_gps_ns"][0].astype(np.int64)
    position, velocity, fixed = zip(
        *(one.errors(t_ns, mine) for one, mine in zip(craft, rows, strict=True)), strict=True
    )
    alike = fixed[0] & fixed[1]
    for row, _ in craft[0].used(t_ns) ^ craft[1].used(t_ns):
        alike[row] = False
    t_s: F64 = np.arange(float(len(t_ns))) * time.epoch_interval_s
    return Errors(t_s, np.stack(position), np.stack(velocity), alike)
