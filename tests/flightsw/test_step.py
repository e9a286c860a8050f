"""The whole flight software on a fake bus."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import emulator
from dbc import vehicle
from flightsw.step import configure, flight_step, initial_state
from tests.flightsw import synthetic as s
from tests.flightsw.bench import FakeBus, decoded, position_of
from tests.flightsw.test_position import craft

SOYUZ = vehicle.load(Path(emulator.__file__).parent / "vehicles" / "soyuz-ms.toml")


def soyuz_craft(**more):
    return craft(levers=SOYUZ.lever_arm_body_m, **more)


def fly(bus, config, epochs, state=None, tamper=None, first=0):
    state = initial_state(config) if state is None else state
    out, blocks, states = [], [], []
    answer = None
    for epoch in range(first, first + epochs):
        block = bus.block(epoch, answer) if answer is not None else bus.block(epoch)
        if tamper:
            block = tamper(epoch, block)
        state, answer = flight_step(config, state, block)
        out.append(answer)
        blocks.append(block)
        states.append(state)
    return states, out, blocks


@pytest.mark.parametrize("policy", ["patent", "prototype"])
def test_fix_within_millimetres_of_truth(policy):
    c = soyuz_craft()
    config = configure(SOYUZ, policy, {})
    _, out, _ = fly(FakeBus(c, s.constellation()), config, 8)
    errors = [np.linalg.norm(position_of(b) - s.truth_ecef(c, float(k))[0]) for k, b in enumerate(out)]
    # 1 mm steps of range and satellite position on the bus; prototype has six satellites and poor geometry.
    assert max(errors) < (0.005 if policy == "patent" else 0.05)


def test_patent_takes_over_and_tracks_more():
    config = configure(SOYUZ, "patent", {})
    bus = FakeBus(soyuz_craft(), s.constellation())
    states, out, _ = fly(bus, config, 10)
    satellites = [int(decoded(b, "NAV_STATUS")["satellites"][0]) for b in out]
    assert satellites[0] == 6
    assert satellites[-1] >= 20
    assert states[-1].commander.tally.accepted == states[-1].commander.tally.sent
