"""What stays the same for a run: vehicle, policy, navigator and their options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import numpy as np
from pydantic import ValidationError, create_model

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.faults import faults
from gnss_hil.dbc.common.near import hint
from gnss_hil.dbc.common.vehicle import Strict, Vehicle
from gnss_hil.dbc.contract.codec import Codec, codec
from gnss_hil.dbc.contract.e2e_state import Limits, limits
from gnss_hil.flightsw.app.modes import ModeOptions
from gnss_hil.flightsw.app.own_options import own_options
from gnss_hil.flightsw.assignment.options import AssignmentOptions
from gnss_hil.flightsw.assignment.registry import Policy, policy
from gnss_hil.flightsw.attitude.options import AttitudeOptions
from gnss_hil.flightsw.estimation.base import Navigator
from gnss_hil.flightsw.estimation.registry import navigator
from gnss_hil.flightsw.integrity.options import IntegrityOptions
from gnss_hil.flightsw.measurement.budget import Budget, budget_of
from gnss_hil.flightsw.measurement.options import MeasurementOptions
from gnss_hil.flightsw.measurement.signals import seconds
from gnss_hil.flightsw.receivers.options import ChannelOptions


class Options(
    ModeOptions, ChannelOptions, AttitudeOptions, IntegrityOptions, MeasurementOptions, AssignmentOptions
):
    """All options of a flight, one flat set; each room declares its own. Fields stand in the order of the
    bases from the last to the first."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightConfig:
    """navigator   built from the options; its row of `estimation.registry` is navigator_name
    limits      of the state machines of protected streams
    second      (m, 8) by receiver and system: signal that satellites are tracked by beside the first, 0 none
    """

    vehicle: Vehicle
    codec: Codec
    policy: Policy
    navigator_name: str
    navigator: Navigator[Any]
    options: Options
    budget: Budget
    limits: Limits
    boot_count: int
    second: I64


def options_of(policy_name: str, navigator_name: str | None = None) -> type[Options]:
    """The options of all flights with a policy's and a navigator's own; where several declare one, the
    policy's counts, then the navigator's. Without a navigator's name it is the policy's.

    ValueError names what is not known, and what a row may not declare.
    """
    row = policy(policy_name)
    estimator = navigator(navigator_name or row.navigator)
    own = (
        own_options(f"policy '{row.name}'", row.options, Options),
        own_options(f"navigator '{estimator.name}'", estimator.options, Options),
    )
    return _merged(tuple(dict.fromkeys(model for model in own if not issubclass(Options, model))))


@cache
def _merged(own: tuple[type[Strict], ...]) -> type[Options]:
    """Models of options of their own with those of all flights."""
    return cast(type[Options], create_model("FlightOptions", __base__=(*own, Options)))


def configure(
    vehicle: Vehicle,
    policy_name: str,
    options: Mapping[str, object] | None = None,
    boot_count: int = 0,
    navigator_name: str | None = None,
) -> FlightConfig:
    """What stays the same for a run; without a navigator's name it is the policy's.

    ValueError states what is wrong with a name or with the options.
    """
    row = policy(policy_name)
    estimator = navigator(row.navigator if navigator_name is None else navigator_name)
    values = _checked(dict(options or {}), row.name, estimator.name)
    built = estimator.build(values)
    second = seconds(vehicle.other_signals)
    return FlightConfig(
        vehicle,
        codec(vehicle.antennas),
        row,
        estimator.name,
        built,
        values,
        budget_of(vehicle.receivers, values),
        limits(vehicle.protection),
        boot_count % 256,
        second if values.ionosphere_free else np.zeros_like(second),
    )


def _checked(options: Mapping[str, object], policy_name: str, navigator_name: str) -> Options:
    """The options as their models have them; ValueError has a line for each that is wrong."""
    model = options_of(policy_name, navigator_name)
    origin = f"policy '{policy_name}', navigator '{navigator_name}'"
    allowed = ", ".join(sorted(model.model_fields))
    lines = [
        f"{origin}: {name}: unknown option; there are {allowed}{hint(name, model.model_fields)}"
        for name in options
        if name not in model.model_fields
    ]
    try:
        known = {name: value for name, value in options.items() if name in model.model_fields}
        values = model.model_validate(known)
    except ValidationError as error:
        raise ValueError("\n".join([*lines, *faults(error, origin)])) from None
    if lines:
        raise ValueError("\n".join(lines))
    return values


def carried_over(
    options: Mapping[str, Any], policy_name: str, before: str | None, after: str | None
) -> dict[str, Any]:
    """Options of a flight whose navigator `before` gives way to `after`, None the policy's: without those
    that the former alone has. What neither has stays, to be refused.

    ValueError names what is not known.
    """
    had, has = (options_of(policy_name, name).model_fields for name in (before, after))
    return {name: value for name, value in options.items() if name in has or name not in had}
