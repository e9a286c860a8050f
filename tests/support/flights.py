"""The whole flight software on a fake bus, epoch by epoch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.frames import EMPTY
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from tests.support import synthetic_epochs as s
from tests.support.fixes import craft
from tests.support.flown import CODEC, decoded, position_of

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
SKY = s.constellation()
TRACK, AUTONOMOUS = (raw_of("Action")[word] for word in ("TRACK", "AUTONOMOUS"))


def soyuz(rate=(0.0, -0.00113, 0.0), **more):
    return replace(craft(levers=SOYUZ.lever_arm_body_m, **more), rate_body=np.array(rate))


def fly(bus, config, epochs, state=None, first=0, tamper=lambda epoch, block: block, answer=EMPTY):
    """States, answers and blocks of consecutive epochs."""
    state = initial_state(config) if state is None else state
    states, answers, blocks = [], [], []
    for epoch in range(first, first + epochs):
        block = tamper(epoch, bus.block(epoch, answer))
        state, answer = flight_step(config, state, block)
        states.append(state)
        answers.append(answer)
        blocks.append(block)
    return states, answers, blocks


def error_m(c, answer, t):
    return np.linalg.norm(position_of(answer) - s.truth_ecef(c, float(t))[0])


def status(answer, name):
    return int(decoded(answer, "NAV_STATUS")[name][0])


def used(answer):
    """(receiver, channel) in the fix, from NAV_USED."""
    v = decoded(answer, "NAV_USED")
    pairs = zip(v["receiver"].tolist(), v["channels"].tolist(), strict=True)
    return {(receiver, k) for receiver, mask in pairs for k in range(32) if mask >> k & 1}


def tracked(block):
    """(receiver, channel) -> satellite, from the SV_CLOCK frames of a block."""
    rows = block[CODEC.kind_of[block.can_id] == CODEC.kinds["SV_CLOCK"].number]
    v = CODEC.decode("SV_CLOCK", rows.data)
    sats = (64 * v["sat_system"] + v["sat_number"]).tolist()
    return dict(
        zip(zip(CODEC.number_of[rows.can_id].tolist(), v["channel"].tolist(), strict=True), sats, strict=True)
    )


def drop(kinds, epochs):
    numbers = [CODEC.kinds[kind].number for kind in kinds]
    return lambda epoch, block: (
        block[~np.isin(CODEC.kind_of[block.can_id], numbers)] if epoch in epochs else block
    )
