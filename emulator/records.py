"""What the emulator is made of: worlds that do not change in a run, and states between epochs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc.codec import Codec
from dbc.e2e import Verdict
from dbc.vehicle import Vehicle
from emulator.factors.receiver import LossOfLock
from emulator.hull import Hull
from emulator.observed.craft import ObservedCraft, ObservedUnit
from emulator.onboard import attitude_error
from emulator.onboard.attitude_error import Sensors
from emulator.onboard.instant import Instant
from emulator.radio import Radio
from emulator.receivers import frames, search
from emulator.receivers.carrier import Carrier
from emulator.receivers.channels import Channels, Knowledge, Numbers, Pace
from emulator.scenario import Receivers
from emulator.signals.clock import Clocks, ClockState
from emulator.signals.rays import Effect
from emulator.world.almanac_orbits import HeldAlmanac
from emulator.world.attitude import Attitude
from emulator.world.attitude_table import TabulatedAttitude
from emulator.world.motion import Motion
from emulator.world.sky import Sky
from emulator.world.sun import Sun


@dataclass(frozen=True, slots=True, eq=False)
class CraftWorld:
    """What does not change of one craft.

    key              64 bits that stand for its name in the random draws
    settings         receivers' parameters of the scenario
    radio            its link budget, None for the plain one
    hull             its structure, None where nothing depends on it
    effects          error factors at work on what its receivers measure
    draws            whether any of them draws random words
    clocks           its receivers' oscillators
    carrier          how its carrier phases come about
    lock             what its loops hold, None: all above the threshold
    by_frames        whether ephemerides take as long as the frames of their messages
    holders          1: its receivers share ephemerides; their number: they do not
    sensors          its gyros and star sensor, None where the attitude is known exactly
    instant          when its receivers latch
    epochs_per_pass  epochs in which the almanac is sent once
    """

    name: str
    key: int
    vehicle: Vehicle
    orbit: Motion
    attitude: Attitude | TabulatedAttitude
    settings: Receivers
    pace: Pace
    rule: search.Rule
    radio: Radio | None
    hull: Hull | None
    effects: tuple[Effect, ...]
    draws: bool
    clocks: Clocks
    carrier: Carrier
    lock: LossOfLock | None
    by_frames: bool
    holders: int
    sensors: Sensors | None
    instant: Instant
    epochs_per_pass: int
    codec: Codec
    stationery: frames.Stationery


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """What does not change in a run.

    sun      where it is
    almanac  what all receivers hold, None: the sky itself
    row_of   (SATELLITES,) row of the sky by satellite index, -1 none
    """

    seed: int
    session: int
    start_ns: int
    interval_ns: int
    ray_height_m: float
    sky: Sky
    sun: Sun
    almanac: HeldAlmanac | None
    row_of: Numbers
    systems: int
    craft: tuple[CraftWorld | ObservedCraft, ...]


@dataclass(frozen=True, slots=True, eq=False)
class UnitState:
    """One craft between epochs.

    clocks        its receivers' oscillators, None before the first epoch
    believed      what the on-board computer takes for its attitude, None before the first epoch
    sent, heard   counters of protected streams, as sender and receiver
    refused       (verdicts,) command frames rejected so far, by `dbc.e2e.Verdict`
    """

    clocks: ClockState | None
    believed: attitude_error.Knowledge | None
    channels: Channels
    knowledge: Knowledge
    sent: NDArray[np.int8]
    heard: NDArray[np.int8]
    refused: Numbers


@dataclass(frozen=True, slots=True, eq=False)
class EmulatorState:
    """All craft between epochs, in the scenario's order."""

    units: tuple[UnitState | ObservedUnit, ...]


def commands_rejected(state: EmulatorState) -> dict[str, int]:
    """Command frames that all craft have rejected so far, by reason; only reasons that occurred."""
    total = sum(unit.refused for unit in state.units)
    return {verdict.name: int(total[verdict]) for verdict in Verdict if total[verdict]}
