"""Real epochs for the displays: emulator and flight software stepped by hand, batch to batch."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.emulator import assemble
from gnss_hil.emulator.journal import TruthLog
from gnss_hil.emulator.step import emulate_step
from gnss_hil.emulator.truth import TRUTH
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.tools.run_config.plan import Plan, make

EPOCHS = 75
"""Enough for a hot start, the first fix, and commanded channels."""


@cache
def soyuz() -> Plan:
    return make("soyuz")


@cache
def epochs() -> tuple[tuple[FrameBatch, ...], np.ndarray]:
    """Frames of each epoch as a bus carries them, and the rows of truth (e,)."""
    plan = soyuz()
    (name,), (config,) = plan.names, plan.flights
    emulated, flown, answers = assemble.initial_state(plan.world), initial_state(config), EMPTY
    blocks, rows = [], []
    for epoch in range(EPOCHS):
        emulated, sent, truth = emulate_step(plan.world, emulated, {name: answers}, epoch)
        flown, answers = flight_step(config, flown, sent[name])
        blocks.append(concat((sent[name], answers)))
        rows.append(truth)
    return tuple(blocks), np.concatenate(rows)


def write_truth(path: Path, rows: np.ndarray) -> Path:
    with TruthLog(path, TRUTH, soyuz().names) as log:
        log.add(rows, 0.0)
    return path
