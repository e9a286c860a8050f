"""From a scenario to a world that can be stepped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.assemble.emulated import build_emulated
from gnss_hil.emulator.assemble.shared import (
    Shared,
    broadcast_ionosphere,
    models_of_sky,
    motions,
    report_errors,
)
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.config.tables import Tell
from gnss_hil.emulator.constellation.almanac import orbits
from gnss_hil.emulator.constellation.almanac.orbits import HeldAlmanac
from gnss_hil.emulator.constellation.sky import build_sky
from gnss_hil.emulator.earth.sun_table import Sun
from gnss_hil.emulator.environment.block import SkyCache
from gnss_hil.emulator.faults import engine
from gnss_hil.emulator.faults.engine import FaultPlan
from gnss_hil.emulator.faults.kinds.row import RUN
from gnss_hil.emulator.faults.models import FaultError
from gnss_hil.emulator.files import finals
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.receivers.base import Craft
from gnss_hil.emulator.state import EmulatorState, World


def build_world(
    given: scenario.Scenario,
    vehicles: Sequence[Vehicle],
    session: int,
    resolve_path: Callable[[str], Path] = Path,
    period_s: float | None = None,
) -> World:
    """The world of a scenario; ScenarioError with one line if there is none.

    vehicles      one for each craft of the scenario
    session       identifier of the run, 16 bit
    resolve_path  name of a navigation file as the scenario writes it -> the file
    period_s      wall time from one epoch to the next at a pace: when work is done, not what comes out
    """
    if len(vehicles) != len(given.craft):
        raise ScenarioError(f"craft: {len(given.craft)} in the scenario, {len(vehicles)} vehicle files")
    if not 0 <= session < 1 << 16:
        raise ScenarioError(f"session: {session} is not a 16-bit number")
    time = given.time
    remarks = _rounded(time)
    sky = build_sky(
        given.sky,
        time,
        resolve_path,
        lambda index: report_errors(models_of_sky(given, resolve_path, index)),
        remarks.append,
        emulated=all(craft.observations is None for craft in given.craft),
    )
    row_of = np.full(satellites.SATELLITES, -1)
    row_of[sky.index] = np.arange(len(sky.index))
    measured = _orientation(time, resolve_path, remarks.append)
    shared = Shared(
        given,
        session,
        resolve_path,
        sky,
        SkyCache(sky, keep=2 * len(given.craft)),
        Sun(gpstime.leap_seconds(time.start_ns)),
        _almanac(given, resolve_path, sky.index, remarks.append),
        row_of,
        models_of_sky(given, resolve_path, sky.index),
        measured,
        motions(given, measured, remarks.append),
        broadcast_ionosphere(given, resolve_path),
        period_s,
        remarks.append,
    )
    craft = tuple(
        next(kind for kind in RECEIVER_KINDS if kind.of(one)).build(shared, one, v)
        for one, v in zip(given.craft, vehicles, strict=True)
    )
    told = tuple(dict.fromkeys(remarks))
    faults = fault_plans(given, craft, session, sky.index)
    return World(given.seed, session, time.start_ns, time.interval_ns, sky, row_of, craft, told, faults)


_UNREMARKED_S = 1e-3
"""A run that is longer or shorter by less has the length that was asked for."""


def _rounded(time: scenario.Time) -> list[str]:
    """A line where the run is longer or shorter than asked for, because it has whole epochs."""
    if abs(time.played_s - time.duration_s) < _UNREMARKED_S:
        return []
    return [
        f"duration_s {time.duration_s:g} is no whole number of epochs of {time.epoch_interval_s:g} s: "
        f"{time.played_s:g} s are played"
    ]


def fault_plans(
    given: scenario.Scenario, craft: Sequence[Craft], session: int, index: I64
) -> tuple[FaultPlan, ...]:
    """The scenario's faults on each craft's bus, none if it has none; ScenarioError, a line each, for those
    that cannot be.

    index   (n,) of the satellites that there are
    """
    sky = np.isin(np.arange(satellites.SATELLITES), index)
    names = [one.name for one in craft]
    wrong = [
        f"fault.{number}.craft: no craft '{fault.craft}'; {did_you_mean(fault.craft, names)}"
        for number, fault in enumerate(given.fault)
        if fault.craft is not None and fault.craft not in names
    ]
    plans: list[FaultPlan] = []
    for one in craft if given.fault else ():
        try:
            plans.append(
                engine.armed(
                    given.fault,
                    one.name,
                    one.vehicle,
                    one.codec,
                    given.time.interval_ns,
                    given.seed,
                    session,
                    RUN,
                    sky=sky,
                )
            )  # fmt: skip
        except FaultError as error:
            wrong += str(error).splitlines()
    if wrong:
        raise ScenarioError("\n".join(dict.fromkeys(wrong)))
    return tuple(plans)


def initial_state(world: World) -> EmulatorState:
    """Every unit as it is before the first epoch."""
    return EmulatorState(
        tuple(craft.fresh() for craft in world.craft), tuple(engine.fresh(plan) for plan in world.faults)
    )


def _recorded(shared: Shared, craft: scenario.Craft, vehicle: Vehicle) -> Craft:
    # Reading observations is for runs that play them.
    from gnss_hil.emulator.assemble.recorded import build_recorded

    return build_recorded(shared, craft, vehicle)


@dataclass(frozen=True, slots=True)
class ReceiverKind:
    """A kind of receivers.

    of      whether a craft of a scenario has receivers of this kind
    build   the craft; ScenarioError with one line if there is none
    """

    name: str
    of: Callable[[scenario.Craft], bool]
    build: Callable[[Shared, scenario.Craft, Vehicle], Craft]


RECEIVER_KINDS = [
    ReceiverKind("recorded", lambda craft: craft.observations is not None, _recorded),
    ReceiverKind("emulated", lambda craft: True, build_emulated),
]
"""A craft has receivers of the first kind that it is of."""


def _orientation(
    time: scenario.Time, resolve_path: Callable[[str], Path], tell: Tell
) -> finals.Orientation | None:
    """The Earth's measured orientation over a run, if its scenario names a file."""
    if time.orientation is None:
        return None
    try:
        found = finals.read(resolve_path(time.orientation))
        found.check(*time.span_ns)
    except FileError as error:
        raise ScenarioError(f"time.orientation: {error}") from None
    if found.measured_ns is not None and time.span_ns[1] > found.measured_ns:
        since = gpstime.iso(found.measured_ns)[:10]
        tell(f"time.orientation: {found.origin}: UT1 is predicted, not measured, after {since}")
    return found


def _almanac(
    given: scenario.Scenario, resolve_path: Callable[[str], Path], index: I64, tell: Tell
) -> HeldAlmanac | None:
    """The almanac that a scenario names, for the satellites (n,) of its sky."""
    if not given.sky.almanac:
        return None
    try:
        paths = [resolve_path(name) for name in given.sky.almanac]
        held = orbits.read(paths, index, given.time.start_ns)
    except FileError as error:
        raise ScenarioError(f"sky.almanac: {error}") from None
    for remark in orbits.remarks(held, index, given.time.start_ns):
        tell(f"sky.almanac: {', '.join(map(str, paths))}: {remark}")
    return held
