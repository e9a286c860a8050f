"""Real epochs for the displays: emulator and flight software stepped by hand, batch to batch."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from dbc.frames import EMPTY, FrameBatch, concat
from emulator import build
from emulator.journal import TruthLog
from emulator.step import emulate_step
from emulator.truth import TRUTH
from flightsw import step as flight
from tools.arguments import unchanged
from tools.plan import Plan, make

EPOCHS = 75
"""Enough for a hot start, the first fix, and commanded channels."""


@cache
def soyuz() -> Plan:
    return make(unchanged("soyuz"))


@cache
def epochs() -> tuple[tuple[FrameBatch, ...], np.ndarray]:
    """Frames of each epoch as a bus carries them, and the rows of truth (e,)."""
    plan = soyuz()
    (name,), (config,) = plan.names, plan.flights
    emulated, flown, answers = build.initial_state(plan.world), flight.initial_state(config), EMPTY
    blocks, rows = [], []
    for epoch in range(EPOCHS):
        emulated, sent, truth = emulate_step(plan.world, emulated, {name: answers}, epoch)
        flown, answers = flight.flight_step(config, flown, sent[name])
        blocks.append(concat((sent[name], answers)))
        rows.append(truth)
    return tuple(blocks), np.concatenate(rows)


def write_truth(path: Path, rows: np.ndarray) -> Path:
    with TruthLog(path, TRUTH, soyuz().names) as log:
        log.add(rows, 0.0)
    return path
