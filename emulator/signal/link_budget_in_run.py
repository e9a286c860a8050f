"""From a scene's geometry to C/N0: the link budget, as rich as the scenario's factors make it.

Without any of them it is that of `emulator.signal.simple_link_budget`. One factor that is on brings the
full budget, in
which what the others would say is taken from the same plain model: isotropic transmitters at the promised
power, a receive pattern linear in the cosine, one noise temperature.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.config.scenario import Receivers, ScenarioError
from gnss_hil.emulator.constellation.sky import SkyState
from gnss_hil.emulator.error_models.base import Factor
from gnss_hil.emulator.error_models.params_link import ReceivePattern
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.signal import (
    antenna_patterns,
    equipment,
    frontend,
    jamming,
    link_budget,
    simple_link_budget,
)
from gnss_hil.emulator.signal.geometry import Antennas, Array
from gnss_hil.emulator.signal.jamming import Jammers
from gnss_hil.emulator.signal.link_budget import Budget
from gnss_hil.emulator.signal.visibility import View

NAMES = ("transmit_pattern", "receive_pattern", "link_budget", "jamming")
"""The factors that make the budget."""


@dataclass(frozen=True, slots=True, eq=False)
class Radio:
    """What does not change of a craft's reception."""

    budget: Budget
    jammers: Jammers | None


def plain_antennas(settings: Receivers, vehicle: Vehicle) -> antenna_patterns.Receive:
    """Antennas by the receivers' two gains."""
    plain = ReceivePattern(gain_dbi=settings.gain_dbi, gain_at_90deg_dbi=settings.gain_at_90deg_dbi)
    return equipment.antennas_of(plain, vehicle.names)


def build_radio(
    factors: Mapping[str, Factor], vehicle: Vehicle, settings: Receivers, start_ns: int, craft: str
) -> Radio | None:
    """The budget of a craft, None if none of its factors is on; ScenarioError if one cannot be used."""
    if not set(NAMES) & factors.keys():
        return None
    try:
        parts = _transmitters(factors, start_ns), _antennas(factors, vehicle, settings)
    except (ValueError, FileError) as error:
        raise ScenarioError(f"craft.{craft}.factors: {error}") from None
    front = (
        equipment.front_end_of(factors["link_budget"])
        if "link_budget" in factors
        else (frontend.density_wphz(settings.noise_temperature_k), 0.0)
    )
    jammers = equipment.jammers_of(factors["jamming"]) if "jamming" in factors else None
    return Radio(Budget(*parts, *front), jammers)


def _transmitters(factors: Mapping[str, Factor], start_ns: int) -> link_budget.Transmit:
    if "transmit_pattern" not in factors:
        return link_budget.isotropic()
    return equipment.transmitters_of(factors["transmit_pattern"], gpstime.to_calendar(start_ns).date())


def _antennas(
    factors: Mapping[str, Factor], vehicle: Vehicle, settings: Receivers
) -> antenna_patterns.Receive:
    if "receive_pattern" not in factors:
        return plain_antennas(settings, vehicle)
    return equipment.antennas_of(factors["receive_pattern"], vehicle.names)


def cn0_dbhz(
    radio: Radio | None,
    settings: Receivers,
    sky: SkyState,
    view: View,
    antennas: Antennas,
    pos_ecef_m: Array,
    dcm_body_from_ecef: Array,
) -> Array:
    """Carrier to noise density (m, n) [dBHz] of every satellite at every antenna, nothing in the way."""
    system = satellites.system_of(sky.index)
    if radio is None:
        return simple_link_budget.cn0_dbhz(
            system, view.distance_m, view.angle_rad,
            settings.gain_dbi, settings.gain_at_90deg_dbi, settings.noise_temperature_k,
        )  # fmt: skip
    jamming_wphz: Array | float = 0.0
    if radio.jammers is not None:
        arrival = jamming.arrivals(radio.jammers, pos_ecef_m, dcm_body_from_ecef)
        overlaps = jamming.overlaps_perhz(radio.jammers, system, sky.frequency)
        jamming_wphz = jamming.density_wphz(arrival, radio.budget.antennas, antennas.boresight, overlaps)
    off_nadir = link_budget.off_nadir_rad(sky.pos_ecef_m, pos_ecef_m)
    return link_budget.cn0_dbhz(
        radio.budget, sky.index, off_nadir, view.distance_m, view.angle_rad, jamming_wphz
    )
