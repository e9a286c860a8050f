"""What a craft carries, by its factors: oscillators, carrier loops, attitude sensors, the clock of marks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.clocks import bounded_wander, onboard_clock, oscillator
from gnss_hil.emulator.clocks.latch_time import Instant, exact
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models import thermal_noise
from gnss_hil.emulator.error_models.base import Factor
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.receivers.emulated.carrier import Carrier
from gnss_hil.emulator.receivers.emulated.channels import Numbers
from gnss_hil.emulator.sensors import attitude_determination
from gnss_hil.emulator.signal.phase_windup import antenna_axes

FASTEST_CLOCK_MPS = 3000.0
"""What a receiver's clock may add to the range rate: the signal on the bus ends at 13.4 km/s."""


def draws_words(factors: Mapping[str, Factor]) -> bool:
    """Whether any factor draws words for each receiver and satellite."""
    return bool((thermal_noise.THERMAL.keys() | {"cycle_slips"}) & factors.keys())


def clocks(
    craft: scenario.Craft, factors: Mapping[str, Factor], given: scenario.Scenario, key: int, vehicle: Vehicle
) -> bounded_wander.Clocks:
    """Free oscillators, or those that wander within bounds."""
    if "clock_instability" in factors:
        return oscillator.running(factors["clock_instability"], given.seed, key, given.time.interval_ns)
    return bounded_wander.wandering(
        _wander(craft, given.seed, key, vehicle.clock_domain), given.time.interval_ns
    )


def _wander(craft: scenario.Craft, seed: int, key: int, domains: Numbers) -> bounded_wander.Wander:
    """The craft's oscillators, each clock domain with a phase of its own."""
    phase = (
        2
        * np.pi
        * keyed_draws.uniform(keyed_draws.words(seed, key, keyed_draws.CLOCKS, 0, bounded_wander.DOMAINS))[
            :, 0
        ]
    )
    wander = bounded_wander.Wander(1e-3 * craft.clock.amplitude_ms, 2 * np.pi / craft.clock.period_s, phase)
    fastest_mps = LIGHT_MPS * bounded_wander.fastest(wander)
    if fastest_mps > FASTEST_CLOCK_MPS:
        raise ScenarioError(
            f"craft.{craft.name}.clock: amplitude_ms = {craft.clock.amplitude_ms:g} with period_s = "
            f"{craft.clock.period_s:g} drifts by up to {fastest_mps:.0f} m/s; allowed {FASTEST_CLOCK_MPS:.0f}"
        )
    return wander


def carrier(
    craft: scenario.Craft, factors: Mapping[str, Factor], vehicle: Vehicle, time: scenario.Time
) -> Carrier:
    """How carrier phases come about."""
    axes = antenna_axes(vehicle.boresight_body) if "phase_windup" in factors else None
    return Carrier(axes, factors.get("cycle_slips"), craft.receivers.loops, time.epoch_interval_s)


def sensors(factors: Mapping[str, Factor], interval_ns: int) -> attitude_determination.Sensors | None:
    """Gyros and star sensor, None where the attitude is known exactly."""
    factor = factors.get("attitude_error")
    return None if factor is None else attitude_determination.sensors(factor, interval_ns)


def instant(
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
