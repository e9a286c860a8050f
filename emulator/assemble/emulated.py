"""From a scenario to a craft whose receivers are emulated."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.dbc.contract import codec
from gnss_hil.emulator.assemble.shared import Shared, merged, models_of
from gnss_hil.emulator.attitude.turning import build_turning
from gnss_hil.emulator.clocks import bounded_wander
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.constellation import block_types
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.environment import models as joined
from gnss_hil.emulator.environment.block import Environment, epochs_at
from gnss_hil.emulator.environment.carrier_to_noise import Link, PlainReceiver, build_link
from gnss_hil.emulator.environment.models import Clocks
from gnss_hil.emulator.error_models import jamming
from gnss_hil.emulator.error_models.base import Context, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.error_models.registry import FACTORS
from gnss_hil.emulator.faults import when
from gnss_hil.emulator.faults.kinds.inside import Jammer
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.receivers import frames
from gnss_hil.emulator.receivers.base import Craft
from gnss_hil.emulator.receivers.emulated import search
from gnss_hil.emulator.receivers.emulated.channels import Pace
from gnss_hil.emulator.receivers.emulated.craft import Receivers
from gnss_hil.emulator.receivers.emulated.receiver import EmulatedCraft
from gnss_hil.emulator.sensors.base import SensorContext
from gnss_hil.emulator.sensors.frames import Node
from gnss_hil.emulator.sensors.frames import nodes as sensor_nodes
from gnss_hil.emulator.signal.carriers import carriers
from gnss_hil.emulator.signal.structure import file
from gnss_hil.emulator.signal.structure.bodies import Structure, require_outside, structure

FASTEST_CLOCK_MPS = 3000.0
"""What a receiver's clock may add to the range rate: the signal on the bus ends at 13.4 km/s."""


FASTEST_TURN_RPS = 0.12
"""Largest body rate of a slew: the signal on the bus ends at 0.131 rad/s; the orbit takes 0.001."""


_QUINTIC_PEAK = 1.875
"""Largest slope of the quintic that joins two turns (at its middle, 30/16)."""


def build_emulated(shared: Shared, craft: scenario.Craft, vehicle: Vehicle) -> Craft:
    given, settings = shared.given, craft.receivers
    time, rows = given.time, with_jammers(craft.factors.on(), given, craft.name)
    orbit = shared.motion_of(craft.name)
    _check_turns(craft)
    shape = _structure(craft, rows, vehicle)
    key = keyed_draws.key_of(craft.name)
    context = SensorContext(
        given.seed, key, time.start_ns, time.interval_ns, time.span_ns, shared.sky.index, shared.open_path,
        vehicle, settings.loops, shared.motion_of,
    )  # fmt: skip
    try:
        own = models_of(rows, context, f"craft {craft.name}")
        models = merged(own, shared.models)
        link = build_link(
            PlainReceiver(settings.gain_dbi, settings.gain_at_90deg_dbi, settings.noise_temperature_k),
            vehicle.antennas,
            joined.link(models),
        )
        tracking = joined.tracking(models, None)
        oscillator = joined.only(models, Stage.OSCILLATOR)
    except (ValueError, FileError) as error:
        raise ScenarioError(f"craft.{craft.name}.factors: {error}") from None
    try:
        tracked = carriers(vehicle.other_signals, _sent(link, time))
    except ValueError as error:
        raise ScenarioError(f"craft.{craft.name}: vehicle '{vehicle.name}': other_signals: {error}") from None
    mark_domain = _mark_domain(craft, vehicle)
    contract = codec.codec(vehicle.antennas)
    nodes = _sensors(craft, contract, context)
    environment = Environment(
        start_ns=time.start_ns,
        interval_ns=time.interval_ns,
        epochs=time.epochs,
        block_epochs=epochs_at(shared.period_s),
        ray_height_m=given.sky.ray_height_km * 1e3,
        sky=shared.cache,
        sun=shared.sun,
        vehicle=vehicle,
        orbit=orbit,
        attitude=build_turning(craft.name, craft.attitude, time, orbit, shared.measured, shared.tell),
        clocks=_wandering(craft, context, vehicle) if oscillator is None else oscillator.block,
        mark_domain=mark_domain,
        models=models,
        link=link,
        lock_threshold_dbhz=settings.lock_threshold_dbhz,
        structure=shape,
        carriers=tracked,
        others_db=settings.other_signals_gain_db,
        others_m=1e-3 * settings.other_signals_centre_mm,
    )
    receivers = Receivers(
        session=shared.session,
        vehicle=vehicle,
        row_of=shared.row_of,
        almanac=shared.almanac,
        pace=_pace(settings),
        rule=search.RULES[settings.autonomous],
        collection_ns=tracking.collection_ns,
        holders=1 if tracking.shared else vehicle.antennas,
        mark_source=mark_domain + 1,
        epochs_per_pass=max(1, round(settings.almanac_cycle_s / time.epoch_interval_s)),
        codec=contract,
        templates=frames.frame_templates(
            contract, vehicle.antennas, [node.name for node in nodes], shared.ionosphere
        ),
        sensors=nodes,
    )
    return EmulatedCraft(craft.name, environment, receivers)


def with_jammers(rows: Mapping[str, Factor], given: scenario.Scenario, craft: str) -> Mapping[str, Factor]:
    """Error models that are on, with the jammers that are faults of a craft, each in its window of epochs."""
    added = [one for one in given.fault if isinstance(one, Jammer) and one.craft in (None, craft)]
    if not added:
        return rows
    own = rows.get(jamming.ROW.name)
    interval_s = given.time.epoch_interval_s
    body = list(own.body) if isinstance(own, jamming.Jamming) else []
    for one in added:
        window = when.window(one.at, given.time.interval_ns)
        body.append(
            jamming.BodyJammer(
                kind=one.spectrum, centre_mhz=one.centre_mhz, bandwidth_mhz=one.bandwidth_mhz,
                direction_body=one.direction_body, received_dbw=one.received_dbw,
                # Between epochs: clocks may put a mark a little beside its instant.
                on_s=max(0.0, (window.start - 0.5) * interval_s),
                off_s=None if window.stop is None else (window.stop - 0.5) * interval_s,
            )
        )  # fmt: skip
    earth = own.earth if isinstance(own, jamming.Jamming) else ()
    return {**rows, jamming.ROW.name: jamming.Jamming(earth=earth, body=tuple(body))}


def _sent(link: Link, time: scenario.Time) -> Bool:
    """(16, 512) which satellites send which signal: as the transmitters of the link have it, else as the
    blocks of the day do."""
    if link.budget is not None and link.budget.transmitters.sent is not None:
        return link.budget.transmitters.sent
    day = gpstime.to_calendar(time.start_ns).date()
    return block_types.sent_signals(block_types.block_rows(day, "by-date", {}))


def _sensors(craft: scenario.Craft, contract: codec.Codec, context: SensorContext) -> tuple[Node, ...]:
    try:
        return sensor_nodes(contract, craft.sensors.on(), context, f"craft {craft.name}")
    except (ValueError, FileError) as error:
        raise ScenarioError(f"craft.{craft.name}.sensors: {error}") from None


def _structure(craft: scenario.Craft, rows: Mapping[str, Factor], vehicle: Vehicle) -> Structure | None:
    """The craft's structure, None if no model needs it; ScenarioError if it cannot be had."""
    wanted = [name for name in rows if "structure" in FACTORS[name].needs]
    if not wanted:
        return None
    if craft.structure is None:
        raise ScenarioError(
            f"craft.{craft.name}.factors.{wanted[0]}: needs the craft's structure; name it: structure = "
            f'"FILE", shipped are {", ".join(file.shipped())}'
        )
    try:
        shape = structure(file.load(file.find(craft.structure)))
        require_outside(shape, dict(zip(vehicle.names, vehicle.lever_arm_body_m, strict=True)))
    except file.StructureError as error:
        raise ScenarioError(f"craft.{craft.name}.structure: {error}") from None
    return shape


def _wandering(craft: scenario.Craft, context: Context, vehicle: Vehicle) -> Clocks:
    """The craft's oscillators where no model has them otherwise: each clock domain's wanders within bounds,
    in a phase of its own."""
    phase = bounded_wander.phases_rad(context.seed, context.key)
    wander = bounded_wander.Wander(1e-3 * craft.clock.amplitude_ms, 2 * np.pi / craft.clock.period_s, phase)
    fastest_mps = LIGHT_MPS * bounded_wander.fastest(wander)
    if fastest_mps > FASTEST_CLOCK_MPS:
        raise ScenarioError(
            f"craft.{craft.name}.clock: amplitude_ms = {craft.clock.amplitude_ms:g} with period_s = "
            f"{craft.clock.period_s:g} drifts by up to {fastest_mps:.0f} m/s; allowed {FASTEST_CLOCK_MPS:.0f}"
        )
    interval_ns = context.interval_ns
    return lambda epochs: bounded_wander.over(wander, epochs.number * interval_ns / NS_PER_S)


def _mark_domain(craft: scenario.Craft, vehicle: Vehicle) -> int:
    """The clock domain that time marks are read from, -1: the on-board computer's clock."""
    domain = craft.clock.mark_domain
    if domain is None:
        return -1
    if domain not in vehicle.clock_domain:
        used = ", ".join(map(str, sorted(set(vehicle.clock_domain.tolist()))))
        raise ScenarioError(f"craft.{craft.name}.clock.mark_domain is {domain}; the vehicle has {used}")
    return domain


def _pace(settings: scenario.Receivers) -> Pace:
    seconds = settings.hot_s, settings.warm_s, settings.cold_s, settings.ephemeris_s, settings.ephemeris_age_s
    return Pace(*(round(s * NS_PER_S) for s in seconds))


def _check_turns(craft: scenario.Craft) -> None:
    """Refuse slews faster than the bus can report."""
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
