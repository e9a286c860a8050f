"""One epoch as a craft meets it: geometry, link budget and clocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc import satellites
from dbc.gpstime import NS_PER_S
from emulator.receivers.channels import Flags
from emulator.records import CraftWorld, World
from emulator.signals import clock, geometry, link, view
from emulator.world.orbit import CraftState
from emulator.world.rotations import dcm_of_quaternion
from emulator.world.sky import SkyState


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What is true for one craft at one time mark, whatever its receivers do.

    in_sight  (n,) available and not behind the Earth
    signal    (m, n) strong enough, inside the antenna's field of view
    clock_s   offset (m,) [s] and rate (m,) [s/s] of each receiver's clock;  by_domain_s (8,) offsets
    """

    t_ns: int
    sky: SkyState
    motion: geometry.Motion
    state: CraftState
    quaternion: NDArray[np.float64]
    rate_body_rps: NDArray[np.float64]
    antennas: geometry.Antennas
    view: view.View
    cn0_dbhz: NDArray[np.float64]
    in_sight: Flags
    signal: Flags
    clock_s: tuple[NDArray[np.float64], NDArray[np.float64]]
    by_domain_s: NDArray[np.float64]


def scene_of(world: World, craft: CraftWorld, sky: SkyState, motion: geometry.Motion, t_ns: int) -> Scene:
    """Geometry, link budget and clocks of one craft."""
    vehicle, settings = craft.vehicle, craft.settings
    state = craft.orbit.at(t_ns)
    quaternion, rate = craft.attitude.at(t_ns, state)
    dcm = dcm_of_quaternion(quaternion)
    antennas = geometry.antennas(state, dcm, rate, vehicle.lever_arm_body_m, vehicle.boresight_body)
    sight = view.look(motion, state.pos_ecef_m, antennas)
    cn0_dbhz = link.cn0_dbhz(
        satellites.system_of(sky.index), sight.distance_m, sight.angle_rad,
        settings.gain_dbi, settings.gain_at_90deg_dbi, settings.noise_temperature_k,
    )  # fmt: skip
    in_sight = sky.available & view.in_sight(sight, world.ray_height_m)
    signal = in_sight & (sight.angle_rad <= vehicle.mask_rad[:, None])
    signal &= cn0_dbhz >= settings.lock_threshold_dbhz
    offset_s, drift = clock.offset_s(craft.wander, (t_ns - world.start_ns) / NS_PER_S)
    by_receiver = offset_s[vehicle.clock_domain], drift[vehicle.clock_domain]
    return Scene(
        t_ns, sky, motion, state, quaternion, rate, antennas, sight, cn0_dbhz, in_sight, signal, by_receiver,
        offset_s,
    )  # fmt: skip
