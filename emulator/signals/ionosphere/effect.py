"""The ionosphere at work on measured signals."""

from __future__ import annotations

from emulator.signals.geometry import spin
from emulator.signals.ionosphere.delay import delay_m
from emulator.signals.ionosphere.field import Field
from emulator.signals.ionosphere.slant import slant_tec_and_rate
from emulator.signals.rays import Disturbance, Effect, Rays
from emulator.world.earth import LIGHT_MPS


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
