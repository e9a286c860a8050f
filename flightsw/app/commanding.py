"""Which satellites the receivers shall track: permissions by the policy, and the commands due."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.satellites import NUMBERS, SATELLITES
from gnss_hil.flightsw.app.config import FlightConfig
from gnss_hil.flightsw.app.modes import GUIDANCE, Guidance, Mode
from gnss_hil.flightsw.assignment.boresight_angles import (
    angles_rad,
    boresights_ecef,
    clear_of_earth,
    directions,
)
from gnss_hil.flightsw.assignment.pairs import in_pairs
from gnss_hil.flightsw.attitude.attitude import Attitude
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.orbit.almanac import Predictions
from gnss_hil.flightsw.receivers import channel_manager
from gnss_hil.flightsw.receivers.channel_manager import ChannelManager
from gnss_hil.flightsw.records.commands import Commands
from gnss_hil.flightsw.records.epoch import Mark, Measurements
from gnss_hil.flightsw.records.solution import OrbitState

_NOWHERE = np.full(SATELLITES, -1, np.int64)


def commanded(
    config: FlightConfig,
    mode: Mode,
    channels: ChannelManager,
    permitted: tuple[I64, I64] | None,
    m: Measurements,
    epoch: int,
) -> tuple[ChannelManager, Commands | None]:
    """The channels as the mode and the permissions of `permissions` have them, and the commands due; those
    under way are repeated with or without new permissions."""
    if config.policy.assign is None:
        return channels, None
    if GUIDANCE[mode] is Guidance.RELEASE and channels.commanded:
        channels = channel_manager.surrendered(channels)
    elif permitted is not None:
        channels = channel_manager.planned(channels, permitted[0], m, permitted[1])
    return channel_manager.due(channels, epoch, config.options)


def permissions(
    config: FlightConfig,
    mode: Mode,
    channels: ChannelManager,
    predictions: Predictions,
    orbit: OrbitState | None,
    attitude: Attitude | None,
    mark: Mark,
) -> tuple[I64, I64] | None:
    """Steps 6 to 9: (SATELLITES,) antenna each satellite is permitted on, -1 none, and signal that it is
    tracked by there beside its first, 0 none.

    None where the permissions stand as they are: the receivers choose, the mode assigns nothing, or there is
    no orbit or attitude.
    """
    assign = config.policy.assign
    if assign is None or GUIDANCE[mode] is not Guidance.ASSIGN or orbit is None or attitude is None:
        return None
    vehicle, options, satellites = config.vehicle, config.options, channels.satellites
    sat, pos_sv = almanac.predicted(predictions, mark.t_ns)
    los, distance = directions(pos_sv, orbit.position_m)
    visible = clear_of_earth(los, distance, orbit.position_m, options.ray_height_km * 1e3)
    visible &= predictions.healthy[sat] & (satellites.blocked_until[sat] <= mark.epoch)
    sat, los = sat[visible], los.compress(visible, axis=1)
    theta = angles_rad(los, boresights_ecef(attitude, vehicle.boresight_body))
    permitted, before = _NOWHERE.copy(), satellites.permitted[sat]
    if not options.ionosphere_free:
        permitted[sat] = assign(theta, vehicle.mask_rad, vehicle.channels, before, options)
        return permitted, channel_manager.NO_SECOND
    second = channel_manager.NO_SECOND.copy()
    signal, single = config.second[:, sat // NUMBERS], satellites.single_until[sat] > mark.epoch
    permitted[sat], second[sat] = in_pairs(
        assign, theta, vehicle.mask_rad, vehicle.channels, before, options, signal, single
    )
    return permitted, second
