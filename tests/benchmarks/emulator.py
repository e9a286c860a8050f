"""Time of one emulator epoch, 4 antennas x 6 channels: `python -m tests.benchmarks.emulator`."""

from __future__ import annotations

import os

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")

import time

import numpy as np

from gnss_hil.dbc.contract.frames import EMPTY
from gnss_hil.emulator import assemble
from gnss_hil.emulator.step import emulate_step
from tests.support import emulated

WARM_UP, EPOCHS = 20, 300


def epoch_ms(**receivers) -> tuple[np.ndarray, int]:
    """CPU milliseconds of each epoch, and frames of the last."""
    the_world = emulated.world(emulated.craft(receivers={**emulated.QUICK, **receivers}))
    state, spent = assemble.initial_state(the_world), []
    # Every channel under command, as after the flight software has taken over.
    taken = emulated.run(the_world, 1)[1][0]
    seen = emulated.channels(taken)
    orders = [
        emulated.command(int(r), int(c), emulated.TRACK, emulated.satellites.name(int(s)))
        for r, c, s in zip(seen["receiver"], seen["channel"], seen["sat"], strict=True)
    ]
    inbox = emulated.sealed(*orders)
    for epoch in range(WARM_UP + EPOCHS):
        begun = time.process_time_ns()
        state, sent, _ = emulate_step(the_world, state, {"soyuz": inbox}, epoch)
        spent.append((time.process_time_ns() - begun) / 1e6)
        inbox = EMPTY
    return np.array(spent[WARM_UP:]), len(sent["soyuz"])


if __name__ == "__main__":
    times, count = epoch_ms()
    low, middle, high = np.percentile(times, [0, 50, 99])
    print(f"emulator epoch, {count} frames: CPU {low:.2f} ms least, {middle:.2f} median, {high:.2f} p99")
