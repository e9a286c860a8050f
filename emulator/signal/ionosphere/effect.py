"""The ionosphere at work on measured signals."""

from __future__ import annotations

from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.signal.channel_geometry import Disturbance, Effect, Rays
from gnss_hil.emulator.signal.geometry import spin
from gnss_hil.emulator.signal.ionosphere.delay import delay_m
from gnss_hil.emulator.signal.ionosphere.field import Field
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_and_rate


def ionosphere(field: Field) -> Effect:
    """Code late, carrier and its rate early: an effect on rays. Range rates are the carrier's."""

    def effect(rays: Rays) -> Disturbance:
        scene = rays.scene
        antennas = scene.antennas
        pos, sky = antennas.pos_m[rays.receiver], scene.sky
        vel = (antennas.vel_mps - spin(antennas.pos_m))[rays.receiver]
        content, rate = slant_tec_and_rate(
            field, scene.t_ns, pos, vel, sky.pos_ecef_m[rays.row], sky.vel_ecef_mps[rays.row]
        )
        carrier_hz = LIGHT_MPS / rays.wave_m
        delay = delay_m(content, carrier_hz)
        return Disturbance(delay, -delay, -delay_m(rate, carrier_hz))

    return effect
