"""What the emulator is made of: worlds that do not change in a run, and states between epochs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.e2e import Verdict
from gnss_hil.emulator.attitude.profile import Attitude
from gnss_hil.emulator.attitude.table import TabulatedAttitude
from gnss_hil.emulator.clocks.bounded_wander import Clocks, ClockState
from gnss_hil.emulator.clocks.latch_time import Instant
from gnss_hil.emulator.config.scenario import Receivers
from gnss_hil.emulator.constellation.almanac.orbits import HeldAlmanac
from gnss_hil.emulator.constellation.sky import Sky
from gnss_hil.emulator.earth.sun_table import Sun
from gnss_hil.emulator.error_models.params_receiver import LossOfLock
from gnss_hil.emulator.orbits.motion import Motion
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.emulated import search
from gnss_hil.emulator.receivers.emulated.carrier import Carrier
from gnss_hil.emulator.receivers.emulated.channels import Channels, Knowledge, Numbers, Pace
from gnss_hil.emulator.receivers.recorded.receiver import ObservedCraft, ObservedUnit
from gnss_hil.emulator.sensors import attitude_determination
from gnss_hil.emulator.sensors.attitude_determination import Sensors
from gnss_hil.emulator.signal.channel_geometry import Effect
from gnss_hil.emulator.signal.link_budget_in_run import Radio
from gnss_hil.emulator.signal.structure_effects import Hull


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
    refused       (verdicts,) command frames rejected so far, by `dbc.contract.e2e.Verdict`
    """

    clocks: ClockState | None
    believed: attitude_determination.Knowledge | None
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
