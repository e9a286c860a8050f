"""From a file of observations to a craft that can be played."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from dbc import codec, gpstime, satellites
from dbc.gpstime import NS_PER_S
from dbc.vehicle import Vehicle
from emulator import scenario
from emulator.factors.registry import FACTORS
from emulator.files import rinex_obs
from emulator.files.finals import Orientation
from emulator.files.text import FileError
from emulator.observed.craft import ObservedCraft
from emulator.observed.signals import SIGNALS
from emulator.observed.tracks import tracks
from emulator.receivers import frames
from emulator.scenario import ScenarioError
from emulator.world.motion import read_trajectory

NEAR = 0.1
"""A tag this share of an interval beside a run's epoch still is that epoch's."""

read = lru_cache(maxsize=2)(rinex_obs.read)


def observations(path: str, craft: str) -> rinex_obs.Observations:
    """The observations of a file; ScenarioError with one line if it has faults."""
    try:
        return read(Path(path))
    except FileError as error:
        raise ScenarioError(f"craft.{craft}.observations: {error}") from None


def span_of(path: str, craft: str) -> dict[str, object]:
    """[time] of a run that plays all of a file: its start, length and commonest step."""
    t_ns = observations(path, craft).t_ns
    if len(t_ns) < 2:
        raise ScenarioError(
            f"craft.{craft}.observations: {path}: {len(t_ns)} epochs; two at least are played"
        )
    steps, counts = np.unique(np.diff(t_ns), return_counts=True)
    step_ns = int(steps[np.argmax(counts)])
    return {
        "start_gps": gpstime.to_calendar(int(t_ns[0])),
        "duration_s": (int(t_ns[-1] - t_ns[0]) + step_ns) / NS_PER_S,
        "epoch_interval_s": step_ns / NS_PER_S,
    }


def _refuse(craft: scenario.Craft) -> None:
    """ScenarioError if the scenario asks something of a real receiver that only an emulated one can do."""
    added = [name for name in craft.factors.on() if not FACTORS[name].default]
    if added or craft.structure:
        key = f"factors.{added[0]}" if added else "structure"
        raise ScenarioError(
            f"craft.{craft.name}.{key}: acts on emulated receivers; this one is real and played"
        )


def build_observed(
    given: scenario.Scenario, craft: scenario.Craft, vehicle: Vehicle, measured: Orientation | None
) -> ObservedCraft:
    """The craft of a scenario whose observations are played; ScenarioError if they cannot be.

    measured  the Earth's orientation for its reference, None without a file of it
    """
    time, settings = given.time, craft.observations
    file = observations(settings.file, craft.name)
    if vehicle.antennas != 1:
        raise ScenarioError(
            f"craft.{craft.name}: vehicle '{vehicle.name}' has {vehicle.antennas} antennas; a file is of one"
        )
    nominal_ns = time.start_ns + np.arange(time.epochs) * time.interval_ns
    _refuse(craft)
    step_ns = np.diff(file.t_ns).min(initial=time.interval_ns)
    if abs(time.interval_ns / step_ns - 1) > NEAR:
        raise ScenarioError(
            f"craft.{craft.name}.observations: {settings.file} has an epoch every {step_ns / NS_PER_S:g} s; "
            f"epoch_interval_s is {time.epoch_interval_s:g}"
        )
    number = np.rint((file.t_ns - time.start_ns) / time.interval_ns).astype(np.int64)
    inside = (number >= 0) & (number < time.epochs)
    late_ns = np.abs(file.t_ns - time.start_ns - number * time.interval_ns)
    number = np.where(inside & (late_ns <= NEAR * time.interval_ns), number, -1)
    if not (number >= 0).any():
        raise ScenarioError(f"craft.{craft.name}.observations: {settings.file}: no epoch inside the run")
    marks_ns = nominal_ns.copy()
    marks_ns[number[number >= 0]] = file.t_ns[number >= 0]
    signals = [SIGNALS[name] for name in settings.signals]
    played = tracks(file, signals, number, int(vehicle.channels[0]))
    reference = None
    if settings.reference is not None:
        key = f"craft.{craft.name}.observations.reference"
        span_ns = int(marks_ns[0]), int(marks_ns[-1])
        reference = read_trajectory(settings.reference, span_ns, measured, key)
    frequency = np.zeros(satellites.SATELLITES, np.int64)
    for number, k in file.header.frequencies.items():
        frequency[satellites.index(satellites.GLONASS, number)] = k
    contract = codec.codec(vehicle.antennas)
    return ObservedCraft(
        craft.name,
        vehicle,
        reference,
        frequency,
        played,
        np.searchsorted(played.epoch, np.arange(time.epochs + 1)),
        marks_ns,
        max(1, round(craft.receivers.almanac_cycle_s / time.epoch_interval_s)),
        contract,
        frames.stationery(contract, vehicle.antennas),
    )
