"""From a scenario to a world that can be stepped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract import codec, e2e
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.constellation.almanac import orbits
from gnss_hil.emulator.constellation.almanac.orbits import HeldAlmanac
from gnss_hil.emulator.constellation.sky import build_sky
from gnss_hil.emulator.earth.sun_table import Sun
from gnss_hil.emulator.error_models import craft_models
from gnss_hil.emulator.error_models.observable_effects import Setting, build_effects, sky_effects
from gnss_hil.emulator.files import finals
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.orbits.motion import build_motion, build_turning
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.emulated import search
from gnss_hil.emulator.receivers.emulated.channels import Numbers, Pace, fresh_channels, fresh_knowledge
from gnss_hil.emulator.receivers.recorded.receiver import ObservedCraft, fresh_unit
from gnss_hil.emulator.signal import structure_effects
from gnss_hil.emulator.signal.channel_geometry import Effect
from gnss_hil.emulator.signal.ionosphere.effect import ionosphere
from gnss_hil.emulator.signal.ionosphere.prepare import build_field
from gnss_hil.emulator.signal.link_budget_in_run import build_radio, plain_antennas
from gnss_hil.emulator.state import CraftWorld, EmulatorState, UnitState, World

FASTEST_TURN_RPS = 0.12
"""Largest body rate of a slew: the signal on the bus ends at 0.131 rad/s; the orbit takes 0.001."""

_QUINTIC_PEAK = 1.875
"""Largest slope of the quintic that joins two turns (at its middle, 30/16)."""


def build_world(
    given: scenario.Scenario,
    vehicles: Sequence[Vehicle],
    session: int,
    resolve_path: Callable[[str], Path] = Path,
) -> World:
    """The world of a scenario; ScenarioError with one line if there is none.

    vehicles      one for each craft of the scenario
    session       identifier of the run, 16 bit
    resolve_path  name of a navigation file as the scenario writes it -> the file
    """
    if len(vehicles) != len(given.craft):
        raise ScenarioError(f"craft: {len(given.craft)} in the scenario, {len(vehicles)} vehicle files")
    if not 0 <= session < 1 << 16:
        raise ScenarioError(f"session: {session} is not a 16-bit number")
    time = given.time
    sky = build_sky(given.sky, time, resolve_path, given.seed)
    everywhere = _everywhere(given, resolve_path, sky.index)
    measured = _orientation(time, resolve_path)
    row_of = np.full(satellites.SATELLITES, -1)
    row_of[sky.index] = np.arange(len(sky.index))
    return World(
        given.seed,
        session,
        time.start_ns,
        time.interval_ns,
        given.sky.ray_height_km * 1e3,
        sky,
        Sun(gpstime.leap_seconds(time.start_ns)),
        _almanac(given, resolve_path, sky.index),
        row_of,
        int(satellites.system_of(sky.index).max()) + 1,
        tuple(_craft(given, c, v, everywhere, measured) for c, v in zip(given.craft, vehicles, strict=True)),
    )


def initial_state(world: World) -> EmulatorState:
    """Every unit cold, every channel idle and searching by itself."""
    satellites_of_sky = len(world.sky.index)
    return EmulatorState(
        tuple(
            fresh_unit() if isinstance(craft, ObservedCraft) else _cold(craft, satellites_of_sky)
            for craft in world.craft
        )
    )


def _cold(craft: CraftWorld, satellites_of_sky: int) -> UnitState:
    return UnitState(
        None,
        None,
        fresh_channels(craft.vehicle.channels),
        fresh_knowledge(satellites_of_sky, craft.holders),
        e2e.fresh_counters(),
        e2e.fresh_counters(),
        np.zeros(len(e2e.Verdict), np.int64),
    )


def _craft(
    given: scenario.Scenario,
    craft: scenario.Craft,
    vehicle: Vehicle,
    everywhere: tuple[Effect, ...],
    measured: finals.Orientation | None,
) -> CraftWorld | ObservedCraft:
    if craft.observations is not None:
        # Reading observations is for those who play them.
        from gnss_hil.emulator.receivers.recorded.assemble import build_observed

        return build_observed(given, craft, vehicle, measured)
    return _emulated(given, craft, vehicle, everywhere, measured)


def _emulated(
    given: scenario.Scenario,
    craft: scenario.Craft,
    vehicle: Vehicle,
    everywhere: tuple[Effect, ...],
    measured: finals.Orientation | None,
) -> CraftWorld:
    time, settings = given.time, craft.receivers
    orbit = build_motion(craft, time, measured)
    _check_turns(craft)
    key = keyed_draws.key_of(craft.name)
    contract = codec.codec(vehicle.antennas)
    factors = craft.factors.on()
    collection = factors.get("data_collection")
    radio = build_radio(factors, vehicle, settings, time.start_ns, craft.name)
    antennas = radio.budget.antennas if radio is not None else plain_antennas(settings, vehicle)
    return CraftWorld(
        name=craft.name,
        key=key,
        vehicle=vehicle,
        orbit=orbit,
        attitude=build_turning(craft, time, orbit, measured),
        settings=settings,
        pace=_pace(settings),
        rule=search.RULES[settings.autonomous],
        radio=radio,
        hull=structure_effects.build_hull(craft, factors, vehicle, antennas),
        effects=(
            *build_effects(factors, Setting(given.seed, key, vehicle.antennas, settings.loops)),
            *everywhere,
        ),
        draws=craft_models.draws_words(factors),
        clocks=craft_models.clocks(craft, factors, given, key, vehicle),
        carrier=craft_models.carrier(craft, factors, vehicle, time),
        lock=factors.get("loss_of_lock"),
        by_frames=collection is not None,
        holders=1 if collection is None or collection.shared else vehicle.antennas,
        sensors=craft_models.sensors(factors, time.interval_ns),
        instant=craft_models.instant(craft, factors, given, key, vehicle),
        epochs_per_pass=max(1, round(settings.almanac_cycle_s / time.epoch_interval_s)),
        codec=contract,
        stationery=frames.stationery(contract, vehicle.antennas),
    )


def _orientation(time: scenario.Time, resolve_path: Callable[[str], Path]) -> finals.Orientation | None:
    """The Earth's measured orientation over a run, if its scenario names a file."""
    if time.orientation is None:
        return None
    try:
        found = finals.read(resolve_path(time.orientation))
        found.check(*time.span_ns)
    except FileError as error:
        raise ScenarioError(f"time.orientation: {error}") from None
    return found


def _everywhere(
    given: scenario.Scenario, resolve_path: Callable[[str], Path], index: Numbers
) -> tuple[Effect, ...]:
    """Effects of the sky's factors, the same for all craft."""
    factors = given.sky.factors.on()
    found = sky_effects(factors, given.seed, index)
    if "ionosphere" not in factors:
        return found
    factor = factors["ionosphere"]
    try:
        field = build_field(factor, [resolve_path(name) for name in factor.files], given.time.span_ns)
    except FileError as error:
        raise ScenarioError(f"sky.factors.ionosphere: {error}") from None
    return (*found, ionosphere(field))


def _almanac(
    given: scenario.Scenario, resolve_path: Callable[[str], Path], index: Numbers
) -> HeldAlmanac | None:
    """The almanac that a scenario names, for the satellites (n,) of its sky."""
    if not given.sky.almanac:
        return None
    try:
        paths = [resolve_path(name) for name in given.sky.almanac]
        return orbits.read(paths, index, given.time.start_ns)
    except FileError as error:
        raise ScenarioError(f"sky.almanac: {error}") from None


def _pace(settings: scenario.Receivers) -> Pace:
    seconds = settings.hot_s, settings.warm_s, settings.cold_s, settings.ephemeris_s, settings.ephemeris_age_s
    return Pace(*(round(s * NS_PER_S) for s in seconds))


def _check_turns(craft: scenario.Craft) -> None:
    """Refuse slews faster than the bus can tell."""
    turns = craft.attitude.profile
    for before, after in pairwise(turns):
        change = sum(
            abs(getattr(after, a) - getattr(before, a)) for a in ("roll_deg", "pitch_deg", "yaw_deg")
        )
        rate = _QUINTIC_PEAK * np.deg2rad(change) / (after.t_s - before.t_s)
        if rate > FASTEST_TURN_RPS:
            raise ScenarioError(
                f"craft.{craft.name}.attitude.profile: the turn from {before.t_s:g} s to {after.t_s:g} s "
                f"reaches {np.rad2deg(rate):.1f} deg/s; allowed {np.rad2deg(FASTEST_TURN_RPS):.1f}"
            )
