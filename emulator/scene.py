"""From world to scene: geometry, link budget and clocks of one craft at one latch."""

from __future__ import annotations

from dbc import satellites
from emulator.records import CraftWorld, World
from emulator.signals import geometry, link, view
from emulator.signals.clock import ClockState
from emulator.signals.scene import Scene
from emulator.world.rotations import dcm_of_quaternion
from emulator.world.sky import SkyState


def scene_of(
    world: World, craft: CraftWorld, clocks: ClockState, sky: SkyState, motion: geometry.Motion, t_ns: int
) -> Scene:
    """Geometry, link budget and clocks of one craft; sky and its motion are those of t_ns."""
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
    offset_s, drift = clocks
    by_receiver = offset_s[vehicle.clock_domain], drift[vehicle.clock_domain]
    return Scene(
        t_ns, sky, motion, state, quaternion, rate, antennas, sight, cn0_dbhz, in_sight, signal, by_receiver,
        offset_s,
    )  # fmt: skip
