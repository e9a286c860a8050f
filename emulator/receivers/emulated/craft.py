"""A craft whose receivers are emulated: what does not change of it in a run, and its state between epochs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import I8, I64
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.emulator.constellation.almanac.orbits import HeldAlmanac
from gnss_hil.emulator.environment.block import Environment
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.emulated import search
from gnss_hil.emulator.receivers.emulated.channels import (
    Channels,
    Knowledge,
    Pace,
    fresh_channels,
    fresh_knowledge,
)
from gnss_hil.emulator.sensors.frames import Node


@dataclass(frozen=True, slots=True, eq=False)
class Receivers:
    """What does not change of a craft's receivers.

    session          identifier of the run
    row_of           (SATELLITES,) row of the sky by satellite index, -1 none
    almanac          what they hold, None: the sky itself
    collection_ns    how long an ephemeris takes by system and time, None: as `pace` has it
    holders          1: receivers share ephemerides; their number: they do not
    mark_source      value of the contract's table "MarkClock"
    epochs_per_pass  epochs in which the almanac is sent once
    sensors          nodes of the craft's sensors, in the order in which they send
    """

    session: int
    vehicle: Vehicle
    row_of: I64
    almanac: HeldAlmanac | None
    pace: Pace
    rule: search.Rule
    collection_ns: Callable[[I64, I64], I64] | None
    holders: int
    mark_source: int
    epochs_per_pass: int
    codec: Codec
    templates: frames.FrameTemplates
    sensors: tuple[Node, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Unit:
    """The receivers of a craft between epochs.

    sent, received   counters of protected streams, as sender and receiver
    refused          (verdicts,) command frames rejected so far, by `gnss_hil.dbc.contract.screening.Verdict`
    models           what error models stepped with the receivers remember, in their order
    """

    channels: Channels
    knowledge: Knowledge
    sent: I8
    received: I8
    refused: I64
    models: tuple[object, ...] = ()


def cold(receivers: Receivers, env: Environment, models: int) -> Unit:
    """Everything unknown, every channel idle and searching by itself."""
    return Unit(
        fresh_channels(receivers.vehicle.channels),
        fresh_knowledge(len(env.sky.sky.index), receivers.holders),
        e2e.fresh_counters(receivers.codec),
        e2e.fresh_counters(receivers.codec),
        np.zeros(len(screening.Verdict), np.int64),
        (None,) * models,
    )
