"""What stays the same for a run: vehicle, policy, navigator and their options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import cast

from pydantic import ValidationError, create_model

from gnss_hil.dbc.common.shipped_files import faults
from gnss_hil.dbc.common.vehicle import Strict, Vehicle
from gnss_hil.dbc.contract.codec import Codec, codec
from gnss_hil.flightsw.app.modes import ModeOptions
from gnss_hil.flightsw.assignment.options import AssignmentOptions
from gnss_hil.flightsw.assignment.registry import Policy, policy
from gnss_hil.flightsw.attitude.options import AttitudeOptions
from gnss_hil.flightsw.estimation.registry import NavigatorRow, navigator
from gnss_hil.flightsw.integrity.options import IntegrityOptions
from gnss_hil.flightsw.measurement.options import MeasurementOptions
from gnss_hil.flightsw.receivers.options import ChannelOptions


class Options(
    ModeOptions, ChannelOptions, AttitudeOptions, IntegrityOptions, MeasurementOptions, AssignmentOptions
):
    """All options of a flight, one flat set; each room declares its own. Fields stand in the order of the
    bases from the last to the first."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightConfig:
    vehicle: Vehicle
    codec: Codec
    policy: Policy
    navigator: NavigatorRow
    options: Options
    boot_count: int


@cache
def options_of(own: type[Strict]) -> type[Options]:
    """The options of all flights with a policy's own; where both declare one, the policy's counts."""
    if issubclass(Options, own):
        return Options
    return cast(type[Options], create_model(own.__name__, __base__=(own, Options)))


def configure(
    vehicle: Vehicle,
    policy_name: str,
    options: Mapping[str, object] | None = None,
    boot_count: int = 0,
    navigator_name: str | None = None,
) -> FlightConfig:
    """What stays the same for a run; without a navigator's name it is the policy's.

    ValueError says what is wrong with a name or with the options.
    """
    row = policy(policy_name)
    estimator = navigator(row.navigator if navigator_name is None else navigator_name)
    try:
        values = options_of(row.options).model_validate(dict(options or {}))
    except ValidationError as error:
        raise ValueError("\n".join(faults(error, f"policy '{row.name}'"))) from None
    return FlightConfig(vehicle, codec(vehicle.antennas), row, estimator, values, boot_count % 256)
