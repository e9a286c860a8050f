"""From a scene's geometry to C/N0: the link budget, as rich as the scenario's factors make it.

Without any of them it is that of `emulator.signals.link`. One factor that is on brings the full budget, in
which what the others would say is taken from the same plain model: isotropic transmitters at the promised
power, a receive pattern linear in the cosine, one noise temperature.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dbc import gpstime, satellites
from dbc.vehicle import Vehicle
from emulator.factors.base import Factor
from emulator.factors.link import ReceivePattern
from emulator.files.text import FileError
from emulator.scenario import Receivers, ScenarioError
from emulator.signals import budget, equipment, frontend, jamming, link, patterns
from emulator.signals.bands import BY_SYSTEM
from emulator.signals.geometry import Antennas, Array
from emulator.signals.jamming import Jammers
from emulator.signals.view import View
from emulator.world.sky import SkyState

NAMES = ("transmit_pattern", "receive_pattern", "link_budget", "jamming")
"""The factors that make the budget."""


@dataclass(frozen=True, slots=True, eq=False)
class Radio:
    """What does not change of a craft's reception.

    transmitters   None: isotropic ones
    noise_wphz     density at the antennas' terminals;  loss_db of the digital part
    """

    transmitters: budget.Transmit | None
    antennas: patterns.Receive
    noise_wphz: float
    loss_db: float
    jammers: Jammers | None


def plain_antennas(settings: Receivers, vehicle: Vehicle) -> patterns.Receive:
    """Antennas by the receivers' two gains."""
    plain = ReceivePattern(gain_dbi=settings.gain_dbi, gain_at_90deg_dbi=settings.gain_at_90deg_dbi)
    return equipment.antennas_of(plain, vehicle.names)


def build_radio(
    factors: Mapping[str, Factor], vehicle: Vehicle, settings: Receivers, start_ns: int, craft: str
) -> Radio | None:
    """The budget of a craft, None if none of its factors is on; ScenarioError if one cannot be used."""
    if not set(NAMES) & factors.keys():
        return None
    day = gpstime.to_calendar(start_ns).date()
    try:
        transmitters = (
            equipment.transmitters_of(factors["transmit_pattern"], day)
            if "transmit_pattern" in factors
            else None
        )
        antennas = (
            equipment.antennas_of(factors["receive_pattern"], vehicle.names)
            if "receive_pattern" in factors
            else plain_antennas(settings, vehicle)
        )
    except (ValueError, FileError) as error:
        raise ScenarioError(f"craft.{craft}.factors: {error}") from None
    noise, loss_db = frontend.density_wphz(settings.noise_temperature_k), 0.0
    if "link_budget" in factors:
        front = equipment.budget_of(transmitters, antennas, factors["link_budget"])
        noise, loss_db = front.noise_wphz, front.loss_db
    jammers = equipment.jammers_of(factors["jamming"]) if "jamming" in factors else None
    return Radio(transmitters, antennas, float(noise), loss_db, jammers)


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
        return link.cn0_dbhz(
            system, view.distance_m, view.angle_rad,
            settings.gain_dbi, settings.gain_at_90deg_dbi, settings.noise_temperature_k,
        )  # fmt: skip
    carrier_dbw = _arriving_dbw(radio, sky, view, pos_ecef_m, system)
    noise_wphz: Array | float = radio.noise_wphz
    if radio.jammers is not None:
        arrival = jamming.arrivals(radio.jammers, pos_ecef_m, dcm_body_from_ecef)
        overlaps = jamming.overlaps_perhz(radio.jammers, system, sky.frequency)
        noise_wphz += jamming.density_wphz(arrival, radio.antennas, antennas.boresight, overlaps)
    gain_dbi = patterns.gain_dbi(radio.antennas, view.angle_rad)
    return carrier_dbw + gain_dbi - 10 * np.log10(noise_wphz) - radio.loss_db


def _arriving_dbw(radio: Radio, sky: SkyState, view: View, pos_ecef_m: Array, system: Array) -> Array:
    if radio.transmitters is None:
        return BY_SYSTEM.power_dbwm2[system] - 20 * np.log10(view.distance_m)
    off_nadir = budget.off_nadir_rad(sky.pos_ecef_m, pos_ecef_m)
    return budget.arriving_dbw(radio.transmitters, sky.index, off_nadir, view.distance_m)
