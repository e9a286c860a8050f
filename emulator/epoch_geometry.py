"""From world to scene: geometry, link budget, structure and clocks of one craft at one latch."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.clocks.bounded_wander import ClockState
from gnss_hil.emulator.constellation.sky import SkyState
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternion
from gnss_hil.emulator.signal import geometry, link_budget_in_run, structure_effects, visibility
from gnss_hil.emulator.signal.bands import wavelength_m
from gnss_hil.emulator.signal.epoch_geometry import Scene
from gnss_hil.emulator.signal.tracking_loss import holds
from gnss_hil.emulator.state import CraftWorld, World


def scene_of(
    world: World, craft: CraftWorld, clocks: ClockState, sky: SkyState, motion: geometry.Motion, t_ns: int
) -> Scene:
    """Geometry, link budget and clocks of one craft; sky and its motion are those of t_ns."""
    vehicle, settings = craft.vehicle, craft.settings
    state = craft.orbit.at(t_ns)
    quaternion, rate = craft.attitude.at(t_ns, state)
    dcm = dcm_of_quaternion(quaternion)
    antennas = geometry.antennas(state, dcm, rate, vehicle.lever_arm_body_m, vehicle.boresight_body)
    sight = visibility.look(motion, state.pos_ecef_m, antennas)
    cn0_dbhz = link_budget_in_run.cn0_dbhz(craft.radio, settings, sky, sight, antennas, state.pos_ecef_m, dcm)
    in_sight = sky.available & visibility.in_sight(sight, world.ray_height_m)
    in_field = in_sight & (sight.angle_rad <= vehicle.mask_rad[:, None])
    sun_m = world.sun.at(t_ns)
    around = None
    if craft.hull is not None:
        since_s = (t_ns - world.start_ns) / NS_PER_S
        around = structure_effects.around(craft.hull, sight, motion, state, dcm, rate, sun_m, since_s)
        system = satellites.system_of(sky.index)
        wave_m = wavelength_m(system, sky.frequency)
        candidate = in_field & (cn0_dbhz >= settings.lock_threshold_dbhz)
        cn0_dbhz = structure_effects.heard(around, cn0_dbhz, candidate, system, wave_m)
    signal = in_field & (cn0_dbhz >= settings.lock_threshold_dbhz)
    # What is hidden has no level at all; the loops' formulas begin at 0 dBHz, which no loop holds.
    held = (
        None
        if craft.lock is None
        else in_field & holds(craft.lock, settings.loops, np.maximum(cn0_dbhz, 0.0))
    )
    offset_s, drift = clocks
    by_receiver = offset_s[vehicle.clock_domain], drift[vehicle.clock_domain]
    return Scene(
        t_ns=t_ns,
        sky=sky,
        motion=motion,
        state=state,
        quaternion=quaternion,
        rate_body_rps=rate,
        antennas=antennas,
        view=sight,
        cn0_dbhz=cn0_dbhz,
        in_sight=in_sight,
        signal=signal,
        held=held,
        clock_s=by_receiver,
        by_domain_s=offset_s,
        around=around,
        dcm_body_from_ecef=dcm,
        sun_ecef_m=sun_m,
    )
