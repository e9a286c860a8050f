"""The sizes in the table of mistakes of docs/integrate.md: our flight software with one thing done wrong.

It flies recorded frames of `soyuz-quiet` (no noise, clocks within 1 ms), without its tests of consistency,
which a first version of another flight software will not have; with them, the larger ones are no fix.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.emulator import assemble
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.attitude import attitude
from gnss_hil.flightsw.estimation import all_in_view, position, snapshot
from gnss_hil.flightsw.integrity import exclusion
from gnss_hil.flightsw.measurement import range_model
from gnss_hil.flightsw.orbit.earth import LIGHT_MPS, ROTATION_RPS
from gnss_hil.tools.run_config.plan import make

pytestmark = pytest.mark.verifies(
    "docs/integrate.md",
    what="Sizes of typical mistakes",
    by="measured on this bench, made one by one and measured again within 10 %",
    status="modelled",
)

GUIDE = Path(__file__).parents[2] / "docs" / "integrate.md"
EPOCHS, WARM = 160, 60
TOLERANCE = 0.1


@dataclass(frozen=True, slots=True)
class Mistake:
    """What is done wrong: a function of the flight software, and what is put in its place."""

    phrase: str
    module: object
    function: str
    wrong: Callable[[Callable], Callable]


def measured(change: Callable) -> Callable[[Callable], Callable]:
    """The solver fed with changed measurements."""
    return lambda solve: lambda m, *more: solve(change(m), *more)


def late(solve: Callable) -> Callable:
    """The solver fed with the measurements of the epoch before."""
    before = []

    def solve_late(m, *more):
        before.append(m)
        old = before[-2:][0]
        return solve(old if len(old.sat) == len(m.sat) else m, *more)

    return solve_late


def moved_on(m):
    return replace(m, pos_sv_m=m.pos_sv_m + m.vel_sv_mps * (m.pseudorange_m / LIGHT_MPS))


MISTAKES = (
    Mistake("pseudorange / c as the flight time", range_model, "flight_angle_rad",
            lambda turn: lambda s, a: turn(s, a) + ROTATION_RPS * 1e-3),
    Mistake(
        "satellites not rotated", range_model, "flight_angle_rad", lambda turn: lambda s, a: 0 * turn(s, a)),
    Mistake("rotated the wrong way", range_model, "flight_angle_rad", lambda turn: lambda s, a: -turn(s, a)),
    Mistake("Shapiro delay left out", range_model, "shapiro_m", lambda delay: lambda s, a, r: 0 * r),
    Mistake("lever arms left out", all_in_view, "levers_ecef",
            lambda levers: lambda at, body: tuple(0 * x for x in levers(at, body))),
    Mistake("lever arms with the wrong sign", all_in_view, "levers_ecef",
            lambda levers: lambda at, body: tuple(-x for x in levers(at, body))),
    Mistake("quaternion taken the other way", attitude, "dcm_from_quaternion",
            lambda dcm: lambda q: dcm(q).T),
    Mistake("satellites moved on to the time of reception", all_in_view, "solve", measured(moved_on)),
    Mistake("`clock_m` subtracted", all_in_view, "solve", measured(lambda m: replace(m, clock_m=-m.clock_m))),
    Mistake(
        "`clock_m` left out", all_in_view, "solve", measured(lambda m: replace(m, clock_m=0 * m.clock_m))),
    Mistake("no GLONASS offset", position, "clock_columns",
            lambda columns: lambda domain, system: columns(domain, 0 * system)),
    Mistake("measurements of the epoch before", all_in_view, "solve", late),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Recording:
    """The emulator's blocks of a run, and where the craft was (n, 3) [m]."""

    config: object
    blocks: list[FrameBatch]
    truth_m: np.ndarray


@pytest.fixture(scope="module")
def recording() -> Recording:
    plan = make("soyuz-quiet")
    (name,), (config,) = plan.names, plan.flights
    # As another flight software would, it knows nothing of receivers' delays, which hide some of a mistake,
    # and believes each attitude, also one that does not go along with its rates.
    believing = config.options.model_copy(update={"attitude_hold_epochs": 0})
    config = replace(config, budget=replace(config.budget, delay_m=0.0), options=believing)
    emulated, flown, answer = assemble.initial_state(plan.world), initial_state(config), EMPTY
    blocks, truth_m = [], []
    for epoch in range(EPOCHS):
        emulated, sent, rows = emulate_step(plan.world, emulated, {name: answer}, epoch)
        flown, answer = flight_step(config, flown, sent[name])
        blocks.append(sent[name])
        truth_m.append(rows["position_ecef_m"][0])
    return Recording(config, blocks, np.array(truth_m))


def median_error_m(flight: Recording) -> float:
    """Of the fixes from the second minute on."""
    state, errors = initial_state(flight.config), []
    for epoch, block in enumerate(flight.blocks):
        state, _ = flight_step(flight.config, state, block)
        if epoch >= WARM and state.solution.fix is not None:
            errors.append(np.linalg.norm(state.solution.fix.position_m - flight.truth_m[epoch]))
    assert len(errors) > (EPOCHS - WARM) // 2
    return float(np.median(errors))


def test_without_a_mistake_there_is_no_error(recording):
    assert median_error_m(recording) < 0.001


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda m: m.phrase)
def test_a_mistake_costs_what_the_guide_says(mistake, recording, monkeypatch):
    monkeypatch.setattr(exclusion, "agree", lambda *_: True)
    monkeypatch.setattr(snapshot, "gone_astray", lambda *_: ())
    monkeypatch.setattr(
        mistake.module, mistake.function, mistake.wrong(getattr(mistake.module, mistake.function))
    )
    found = median_error_m(recording)
    print(f"{mistake.phrase}: {found:.3g} m")
    rows = [line for line in GUIDE.read_text().splitlines() if f"| {mistake.phrase}" in line]
    assert len(rows) == 1, mistake.phrase
    number, unit = re.match(r"\| ([\d.]+) (mm|m|km)\b", rows[0]).groups()
    said = float(number) * {"mm": 1e-3, "m": 1.0, "km": 1e3}[unit]
    assert found == pytest.approx(said, rel=TOLERANCE)
