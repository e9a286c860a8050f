"""From measurements to a solution: ranges, what a fix is to know beside them, and the navigator's answer."""

from __future__ import annotations

from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.flightsw.app.config import FlightConfig, Options
from gnss_hil.flightsw.attitude.attitude import Attitude
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.dilution import with_dilution
from gnss_hil.flightsw.integrity.assess import assess
from gnss_hil.flightsw.integrity.publishable import publishable
from gnss_hil.flightsw.measurement.ionosphere import USUAL, Ionosphere
from gnss_hil.flightsw.measurement.ionosphere_filter import IonosphereDelays
from gnss_hil.flightsw.measurement.ionosphere_free import filtered, ionosphere_free
from gnss_hil.flightsw.measurement.observables import of_one_signal
from gnss_hil.flightsw.measurement.registry import other_measurements
from gnss_hil.flightsw.records.epoch import Epoch, Mark, Measurements
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import Solution, SolutionError


def ranges_of(
    m: Measurements, config: FlightConfig, delays: IonosphereDelays, t_ns: int
) -> tuple[IonosphereDelays, Ranges]:
    """Measurements as ranges, one row for each antenna and satellite, and the delays followed until then."""
    options = config.options
    if not options.ionosphere_free:
        return delays, of_one_signal(m, config.budget)
    if not options.ionosphere_walk_mps_rts:
        return delays, ionosphere_free(m, config.budget)
    return filtered(m, config.budget, delays, t_ns, options.ionosphere_walk_mps_rts)


def _ionosphere(options: Options, decoded: Epoch, mark: Mark) -> Ionosphere | None:
    """Over the craft, as ranges are to be corrected for it."""
    reported = {"auto": decoded.ionosphere, "usual": decoded.ionosphere or USUAL, "off": None}
    found = reported[options.ionosphere]
    return None if found is None else Ionosphere(found, (mark.t_ns * 1e-9) % 86_400.0)


def fix_inputs(
    config: FlightConfig,
    decoded: Epoch,
    mark: Mark,
    doubt_s: float,
    attitude: Attitude | None,
    restarted: Bool,
) -> FixInputs:
    vehicle, options = config.vehicle, config.options
    reported = decoded.domains[: vehicle.antennas]
    return FixInputs(
        attitude=attitude,
        lever_arm_body_m=vehicle.lever_arm_body_m,
        domain=np.where(reported >= 0, reported, vehicle.clock_domain),
        budget=config.budget,
        ionosphere=_ionosphere(options, decoded, mark),
        rules=options.rules,
        mark_clock=mark.clock,
        mark_doubt_s=doubt_s,
        restarted=restarted[: vehicle.antennas],
        others=other_measurements(decoded),
    )


def navigated(
    config: FlightConfig, nav: Any, t_ns: int, z: Ranges, inputs: FixInputs
) -> tuple[Any, Solution]:
    """The navigator's state after this epoch and its solution as it is published.

    SolutionError names the navigator if its author has made a solution wrong.
    """
    navigator = config.navigator
    try:
        nav, solution = navigator.update(navigator.predict(nav, t_ns), z, inputs)
        solution = publishable(assess(solution), len(z))
    except SolutionError as error:
        raise SolutionError(f"navigator '{config.navigator_name}': {error}") from error
    return nav, with_dilution(solution, z, inputs)
