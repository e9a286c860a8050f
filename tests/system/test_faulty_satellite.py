"""A satellite's range is off by a fault of one size or another: is it found, and is it the right one?

Emulated receivers under a sky with orbits and clocks as wrong as real ones; some 22 satellites, the vehicle
as it ships, default options. The fault is put on the range of one satellite between the receiver's frames and
the solution, at random, epoch by epoch.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import EMPTY
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config.scenario import find
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.estimation import all_in_view
from gnss_hil.flightsw.records.solution import SnapshotFix
from gnss_hil.tools.run_config.plan import make

pytestmark = [
    pytest.mark.slow(seconds=8),
    pytest.mark.verifies(
        "flightsw/integrity/exclusion.py",
        what="A faulty satellite among 22",
        by="faults put on emulated ranges: 85 % of 15 m and 97 % of 20 m excluded, never a sound satellite",
        status="validated",
    ),
]

ERRORS = "[sky.factors]\nephemeris_error = true\nsatellite_clock_error = true\ncode_bias = true\n\n[[craft]]"
WARM, EPOCHS = 180, 240


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Configuration and state of the flight software when all channels are busy, and the blocks since."""
    folder = tmp_path_factory.mktemp("faulty")
    (folder / "soyuz.toml").write_text(find("soyuz").read_text().replace("[[craft]]", ERRORS))
    plan = make(str(folder / "soyuz.toml"))
    (name,), (config,) = plan.names, plan.flights
    emulated, state, answer = assemble.initial_state(plan.world), initial_state(config), EMPTY
    blocks = []
    for epoch in range(EPOCHS):
        emulated, sent, _ = emulate_step(plan.world, emulated, {name: answer}, epoch)
        if epoch == WARM:
            begin = state
        if epoch >= WARM:
            blocks.append(sent[name])
        state, answer = flight_step(config, state, sent[name])
    return config, begin, blocks


def verdicts(recording, fault_m, monkeypatch, tries=4):
    """Of all faults: how many were excluded, how many times a sound satellite was, and how many times the
    receiver that measured the faulty one, with all its satellites."""
    config, state, blocks = recording
    rng, solve = np.random.default_rng(1), all_in_view.solve
    right = wrong = receivers = count = 0
    for block in blocks:
        for _ in range(tries):
            seen = []

            def faulty(m, *more, seen=seen):
                sat = m.sat[rng.integers(len(m))]
                off_m = fault_m * rng.choice((-1, 1)) * (m.sat == sat)
                fix = solve(replace(m, pseudorange_m=m.pseudorange_m + off_m), *more)
                seen.append((m.sat == sat, m, fix))
                return fix

            with monkeypatch.context() as patch:
                patch.setattr(all_in_view, "solve", faulty)
                flight_step(config, state, block)
            ((is_off, m, fix),) = seen
            out = ~fix.used if isinstance(fix, SnapshotFix) else np.zeros(len(m), bool)
            whole = np.array_equal(out, np.isin(m.receiver, m.receiver[is_off])) and out.sum() > is_off.sum()
            right, receivers, count = right + np.array_equal(out, is_off), receivers + whole, count + 1
            wrong += bool((out & ~is_off).any()) and not whole
        state, _ = flight_step(config, state, block)
    return right / count, wrong, receivers / count


@pytest.mark.parametrize(("fault_m", "found"), [(15.0, 0.6), (20.0, 0.95)])
def test_a_fault_is_found_and_no_sound_satellite_is_taken_for_it(recording, fault_m, found, monkeypatch):
    right, wrong, receivers = verdicts(recording, fault_m, monkeypatch)
    print(f"{fault_m} m: {right:.3f} excluded, {receivers:.4f} with all of its receiver")
    assert right > found and wrong == 0 and receivers < 0.01


def test_without_a_fault_nothing_is_excluded(recording, monkeypatch):
    assert verdicts(recording, 0.0, monkeypatch, tries=1) == (0.0, 0, 0.0)
