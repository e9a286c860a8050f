"""GLONASS satellites from an almanac: mean elements at a node, their drift, and the waves of J2.

The document's argument of latitude drifts within a revolution (`periodic`, last row) though the period from
node to node contains that drift: places run ahead of the motion under J2 by up to 4.8 km before a node, and
jump back there. Kept: the document's worked example has it, and so have receivers that follow it.

Source: GLONASS ICD 5.1 (2008), A.3.2.2
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.constellation.broadcast.glonass import (
    J2_PZ90,
    MU_PZ90_M3PS2,
    RADIUS_PZ90_M,
    ROTATION_PZ90_RPS,
)
from gnss_hil.emulator.constellation.broadcast.gps import eccentric_anomaly_rad

MEAN_PERIOD_S = 43_200.0
MEAN_INCLINATION_RAD = np.deg2rad(63.0)
"""What an almanac's corrections are added to. GLONASS ICD 5.1, A.3.2.1."""

_ROUNDS = 5
"""Of the axis from the period; each leaves a thousandth of the error, and the first starts 20 km off."""


def orbit(elements: dict[str, F64], since_node_s: F64) -> tuple[F64, F64]:
    """Positions and velocities some seconds after the almanac's ascending node.

    elements      see `gnss_hil.emulator.files.almanacs.Almanac`, (n,) each
    since_node_s  (n,), either sign
    returns       (n, 3) PZ-90 of the instant, metres from WGS-84 [m]; Earth-relative velocity (n, 3) [m/s]
    """
    e, omega = elements["e"], elements["omega"]
    period_s = MEAN_PERIOD_S + elements["delta_t"]
    inclination = MEAN_INCLINATION_RAD + elements["delta_i"]
    axis_m = semi_major_axis_m(period_s, inclination, e, omega)
    motion = 2 * np.pi / period_s
    node_rps = (
        -1.5 * J2_PZ90 * motion * (RADIUS_PZ90_M / axis_m) ** 2 * np.cos(inclination) / (1 - e * e) ** 2
    )
    # Whole revolutions from the almanac's node to the last, and the time they take.
    turns = np.floor(since_node_s / period_s)
    whole_s = turns * (period_s + elements["delta_t_dot"] * turns)
    tau_s = since_node_s - whole_s
    # Longitudes from the Greenwich meridian of the instant: the frame turns on after the last node.
    node = elements["longitude"] + (node_rps - ROTATION_PZ90_RPS) * whole_s - ROTATION_PZ90_RPS * tau_s
    at_node = 2 * np.arctan(-np.tan(omega / 2) * np.sqrt((1 - e) / (1 + e)))
    start = at_node - e * np.sin(at_node) + omega
    mean = np.stack((axis_m, e * np.sin(omega), e * np.cos(omega), node, inclination, start + motion * tau_s))
    since_node = motion * tau_s
    at_once = np.stack((np.stack((*mean[:5], start)), mean), axis=1)
    waves = periodic(at_once, np.stack((np.zeros_like(since_node), since_node)))
    return _cartesian(mean + waves[:, 1] - waves[:, 0])


def semi_major_axis_m(period_s: F64, inclination: F64, e: F64, omega: F64) -> F64:
    """Axis (n,) from the period between nodes (n,) [s]; the period of the osculating orbit is not much
    longer. GLONASS ICD 5.1, A.3.2.2."""
    at_node = 1 + e * np.cos(omega)
    level = 1 - e * e
    shape = (2 - 2.5 * np.sin(inclination) ** 2) * level**1.5 / at_node**2 + at_node**3 / level
    axis_m = _two_body_axis_m(period_s)
    for _ in range(_ROUNDS - 1):
        shorter = 1 - 1.5 * J2_PZ90 * (RADIUS_PZ90_M / (axis_m * level)) ** 2 * shape
        axis_m = _two_body_axis_m(period_s / shorter)
    return axis_m


def _two_body_axis_m(period_s: F64) -> F64:
    """Kepler's third law, (n,) [m] from (n,) [s]."""
    return np.cbrt((period_s / (2 * np.pi)) ** 2 * MU_PZ90_M3PS2)


def periodic(mean: F64, passed: F64) -> F64:
    """What J2 adds to mean elements within a revolution.

    mean     (6, ...) axis a [m], h = e sin w, l = e cos w, node, inclination, argument of latitude L [rad]
    passed   (...,) mean angle since the node [rad]: h, l, node, and L drift with it
    returns  (6, ...)
    Source: GLONASS ICD 5.1, A.3.2.2
    """
    a, h, l, _, i, u = mean  # noqa: E741 - the document's letter
    b = 1.5 * J2_PZ90 * (RADIUS_PZ90_M / a) ** 2
    sin_i2, cos_i2 = np.sin(i) ** 2, np.cos(i) ** 2
    lean = 1 - 1.5 * sin_i2
    (s1, s2, s3, s4), (c1, c2, c3, c4) = ([turn(k * u) for k in (1, 2, 3, 4)] for turn in (np.sin, np.cos))
    node = passed + 3.5 * l * s1 - 2.5 * h * c1 - 0.5 * s2 - 7 / 6 * (l * s3 - h * c3)
    return np.stack(
        (
            a * b * (
                2 * lean * (l * c1 + h * s1)
                + sin_i2 * (0.5 * (h * s1 - l * c1) + c2 + 3.5 * (l * c3 + h * s3))
            ),
            b * (
                lean * (l * passed + s1 + 1.5 * (l * s2 - h * c2))
                - sin_i2 / 4 * (s1 - 7 / 3 * s3 + 5 * l * s2 - 8.5 * (l * s4 - h * c4) + h * c2)
                + cos_i2 * (l * passed - 0.5 * l * s2)
            ),
            b * (
                lean * (-h * passed + c1 + 1.5 * (l * c2 + h * s2))
                - sin_i2 / 4 * (-c1 - 7 / 3 * c3 - 5 * h * s2 - 8.5 * (l * c4 + h * s4) + l * c2)
                + cos_i2 * (-h * passed + 0.5 * h * s2)
            ),
            -b * np.cos(i) * node,
            0.5 * b * np.sin(i) * np.cos(i) * (h * s1 - l * c1 + c2 + 7 / 3 * (l * c3 + h * s3)),
            b * (
                2 * lean * (passed + 1.75 * (l * s1 - h * c1))
                + 3 * sin_i2 * (-7 / 24 * (h * c1 + l * s1) - 49 / 72 * (h * c3 - l * s3) + s2 / 4)
                + cos_i2 * node
            ),
        )
    )  # fmt: skip


def _cartesian(osculating: F64) -> tuple[F64, F64]:
    """Positions and Earth-relative velocities (n, 3) of elements (6, n) as in `periodic`."""
    a, h, l, node, i, u = osculating  # noqa: E741
    e, perigee = np.hypot(h, l), np.arctan2(h, l)
    anomaly = eccentric_anomaly_rad(u - perigee, e)
    true = np.arctan2(np.sqrt(1 - e * e) * np.sin(anomaly), np.cos(anomaly) - e)
    speed = np.sqrt(MU_PZ90_M3PS2 / (a * (1 - e * e)))
    latitude = true + perigee
    sin_n, cos_n, sin_u, cos_u = np.sin(node), np.cos(node), np.sin(latitude), np.cos(latitude)
    up = np.stack((cos_u * cos_n - sin_u * sin_n * np.cos(i), cos_u * sin_n + sin_u * cos_n * np.cos(i),
                   sin_u * np.sin(i)), axis=-1)  # fmt: skip
    along = np.stack((-sin_u * cos_n - cos_u * sin_n * np.cos(i), -sin_u * sin_n + cos_u * cos_n * np.cos(i),
                      cos_u * np.sin(i)), axis=-1)  # fmt: skip
    pos = (a * (1 - e * np.cos(anomaly)))[..., None] * up
    vel = (speed * e * np.sin(true))[..., None] * up + (speed * (1 + e * np.cos(true)))[..., None] * along
    vel[..., 0] += ROTATION_PZ90_RPS * pos[..., 1]
    vel[..., 1] -= ROTATION_PZ90_RPS * pos[..., 0]
    return pos, vel
