"""Two craft side by side, played inline: what their fixes are off, and which measurements they used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, SFF_MASK, FrameBatch
from gnss_hil.emulator import assemble
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app import step as flight
from gnss_hil.flightsw.estimation.position import Fix
from gnss_hil.tools.run_config.plan import Plan

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Errors of the fixes of two craft over e epochs, nan where there is none.

    t_s         (e,) since the first epoch [s]
    position_m  (2, e, 3) fix minus truth, ECEF
    velocity_mps  (2, e, 3)
    alike       (e,) whether both fixes are of the same satellites on the same antennas
    """

    t_s: Array
    position_m: Array
    velocity_mps: Array
    alike: NDArray[np.bool_]

    @property
    def difference_m(self) -> Array:
        """(e, 3) error of the relative position: the first craft's less the second's."""
        return self.position_m[0] - self.position_m[1]


def play(plan: Plan, told: Callable[[int], None] = lambda epoch: None) -> Errors:
    """All epochs of a plan of two craft; `told` hears of each."""
    names, configs = plan.names, plan.flights
    emulated = assemble.initial_state(plan.world)
    flown = [flight.initial_state(config) for config in configs]
    answers = dict.fromkeys(names, EMPTY)
    epochs = plan.scenario.time.epochs
    position, velocity = np.full((2, 2, epochs, 3), np.nan)
    alike = np.zeros(epochs, bool)
    for epoch in range(epochs):
        emulated, blocks, truth = emulate_step(plan.world, emulated, answers, epoch)
        used = []
        for craft, name in enumerate(names):
            flown[craft], answers[name] = flight.flight_step(configs[craft], flown[craft], blocks[name])
            fix = flown[craft].fix
            if not isinstance(fix, Fix):
                continue
            position[craft, epoch] = fix.position_m - truth[craft]["position_ecef_m"]
            if fix.velocity_mps is not None:
                velocity[craft, epoch] = fix.velocity_mps - truth[craft]["velocity_ecef_mps"]
            used.append(_used(plan.codecs[craft], blocks[name], answers[name]))
        alike[epoch] = len(used) == 2 and used[0] == used[1]
        told(epoch)
    return Errors(np.arange(epochs) * plan.scenario.time.epoch_interval_s, position, velocity, alike)


def _used(codec: Codec, block: FrameBatch, answer: FrameBatch) -> frozenset[tuple[int, int, int]]:
    """Receiver, system and number of every measurement in a fix, by what both sides have said."""
    masks = dict(_rows(codec, answer, "NAV_USED", ("receiver", "channels")))
    rows = _rows(codec, block, "SV_CLOCK", ("channel", "sat_system", "sat_number"), sender=True)
    return frozenset(
        (receiver, system, number)
        for receiver, channel, system, number in rows
        if masks.get(receiver, 0) >> channel & 1
    )


def _rows(codec: Codec, frames: FrameBatch, kind: str, names: tuple[str, ...], sender: bool = False):
    """Values of a kind's frames, a tuple each; the number of who sent it first, if wanted."""
    mine = frames[codec.kind_of[frames.can_id & SFF_MASK] == codec.kinds[kind].number]
    fields = codec.decode(kind, mine.data)
    columns = [codec.number_of[mine.can_id]] if sender else []
    return zip(*(c.astype(int).tolist() for c in (*columns, *(fields[n] for n in names))), strict=True)
