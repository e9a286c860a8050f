"""From a scenario to a world that can be stepped."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from dbc import codec, e2e, gpstime, satellites
from dbc.gpstime import NS_PER_S
from dbc.vehicle import Vehicle
from emulator import hull, scenario
from emulator.effects import build_effects
from emulator.factors.base import Factor
from emulator.files.text import FileError
from emulator.observed.craft import ObservedCraft, fresh_unit
from emulator.onboard import attitude_error, onboard_clock
from emulator.onboard.instant import Instant, exact
from emulator.radio import build_radio, plain_antennas
from emulator.receivers import frames, search
from emulator.receivers.channels import Numbers, Pace, fresh_channels, fresh_knowledge
from emulator.records import CraftWorld, EmulatorState, UnitState, World
from emulator.scenario import ScenarioError
from emulator.signals import clock, draws, noise, oscillator
from emulator.signals.ionosphere.effect import ionosphere
from emulator.signals.ionosphere.prepare import build_field
from emulator.signals.rays import Effect
from emulator.world.earth import LIGHT_MPS
from emulator.world.motion import build_motion, build_turning
from emulator.world.sky import build_sky
from emulator.world.sun import Sun

FASTEST_CLOCK_MPS = 3000.0
"""What a receiver's clock may add to the range rate: the signal on the bus ends at 13.4 km/s."""

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
    everywhere = _everywhere(given, resolve_path)
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
        row_of,
        int(satellites.system_of(sky.index).max()) + 1,
        tuple(_craft(given, c, v, everywhere) for c, v in zip(given.craft, vehicles, strict=True)),
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
        fresh_knowledge(satellites_of_sky),
        e2e.fresh_counters(),
        e2e.fresh_counters(),
        np.zeros(len(e2e.Verdict), np.int64),
    )


def _craft(
    given: scenario.Scenario, craft: scenario.Craft, vehicle: Vehicle, everywhere: tuple[Effect, ...]
) -> CraftWorld | ObservedCraft:
    if craft.observations is not None:
        # Reading observations is for those who play them.
        from emulator.observed.build import build_observed

        return build_observed(given, craft, vehicle)
    return _emulated(given, craft, vehicle, everywhere)


def _emulated(
    given: scenario.Scenario, craft: scenario.Craft, vehicle: Vehicle, everywhere: tuple[Effect, ...]
) -> CraftWorld:
    time, settings = given.time, craft.receivers
    orbit = build_motion(craft, time)
    _check_turns(craft)
    key = draws.key_of(craft.name)
    contract = codec.codec(vehicle.antennas)
    factors = craft.factors.on()
    radio = build_radio(factors, vehicle, settings, time.start_ns, craft.name)
    antennas = radio.antennas if radio is not None else plain_antennas(settings, vehicle)
    return CraftWorld(
        craft.name,
        key,
        vehicle,
        orbit,
        build_turning(craft, time, orbit),
        settings,
        _pace(settings),
        search.RULES[settings.autonomous],
        radio,
        hull.build_hull(craft.structure, factors, vehicle, antennas, craft.name),
        (*build_effects(factors), *everywhere),
        bool(noise.LOOPS.keys() & factors.keys()),
        _clocks(craft, factors, given, key, vehicle),
        attitude_error.sensors(factors["attitude_error"], time.interval_ns)
        if "attitude_error" in factors
        else None,
        _instant(craft, factors, given, key, vehicle),
        max(1, round(settings.almanac_cycle_s / time.epoch_interval_s)),
        contract,
        frames.stationery(contract, vehicle.antennas),
    )


def _clocks(
    craft: scenario.Craft, factors: Mapping[str, Factor], given: scenario.Scenario, key: int, vehicle: Vehicle
) -> clock.Clocks:
    """Free oscillators, or those that wander within bounds."""
    if "clock_instability" in factors:
        return oscillator.running(factors["clock_instability"], given.seed, key, given.time.interval_ns)
    return clock.wandering(_wander(craft, given.seed, key, vehicle.clock_domain), given.time.interval_ns)


def _sensors(factors: Mapping[str, Factor], interval_ns: int) -> attitude_error.Sensors | None:
    factor = factors.get("attitude_error")
    return None if factor is None else attitude_error.sensors(factor, interval_ns)


def _instant(
    craft: scenario.Craft, factors: Mapping[str, Factor], given: scenario.Scenario, key: int, vehicle: Vehicle
) -> Instant:
    """What time marks are read from."""
    domain = craft.clock.mark_domain
    if domain is not None and domain not in vehicle.clock_domain:
        used = ", ".join(map(str, sorted(set(vehicle.clock_domain.tolist()))))
        raise ScenarioError(f"craft.{craft.name}.clock.mark_domain is {domain}; the vehicle has {used}")
    computer_s = exact
    if "onboard_clock" in factors:
        computer_s = onboard_clock.showing(factors["onboard_clock"], given.seed, key, given.time.interval_ns)
    return Instant(-1 if domain is None else domain, computer_s)


def _everywhere(given: scenario.Scenario, resolve_path: Callable[[str], Path]) -> tuple[Effect, ...]:
    """Effects of the sky's factors, the same for all craft."""
    factors = given.sky.factors.on()
    if "ionosphere" not in factors:
        return ()
    factor = factors["ionosphere"]
    try:
        field = build_field(factor, [resolve_path(name) for name in factor.files], given.time.span_ns)
    except FileError as error:
        raise ScenarioError(f"sky.factors.ionosphere: {error}") from None
    return (ionosphere(field),)


def _pace(settings: scenario.Receivers) -> Pace:
    seconds = settings.hot_s, settings.warm_s, settings.cold_s, settings.ephemeris_s, settings.ephemeris_age_s
    return Pace(*(round(s * NS_PER_S) for s in seconds))


def _wander(craft: scenario.Craft, seed: int, key: int, domains: Numbers) -> clock.Wander:
    """The craft's oscillators, each clock domain with a phase of its own."""
    phase = 2 * np.pi * draws.uniform(draws.words(seed, key, draws.CLOCKS, 0, clock.DOMAINS))[:, 0]
    wander = clock.Wander(1e-3 * craft.clock.amplitude_ms, 2 * np.pi / craft.clock.period_s, phase)
    fastest_mps = LIGHT_MPS * clock.fastest(wander)
    if fastest_mps > FASTEST_CLOCK_MPS:
        raise ScenarioError(
            f"craft.{craft.name}.clock: amplitude_ms = {craft.clock.amplitude_ms:g} with period_s = "
            f"{craft.clock.period_s:g} drifts by up to {fastest_mps:.0f} m/s; allowed {FASTEST_CLOCK_MPS:.0f}"
        )
    return wander


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
