"""Synthetic measurements that share no formula with the flight software.

Everything is computed in an inertial frame, where light goes straight and satellites run on circles: no
Earth rotation during flight, no rotating-frame accelerations appear. Range rates are numerical derivatives
of the pseudorange. The Greenwich frame is the inertial one turned by `theta(t)`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

C = 299_792_458.0
W = 7.2921151467e-5
MU = 3.986004418e14
T0_NS = 1_035_590_400_000_000_000


def turn_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def ecef_from_eci(t):
    """DCM at t seconds after T0."""
    return turn_z(0.3 + W * t)


@dataclass(frozen=True)
class Circle:
    """A circular orbit in the inertial frame."""

    radius: float
    inclination: float
    node: float
    phase: float

    def at(self, t):
        u = self.phase + np.sqrt(MU / self.radius**3) * t
        ci, si, cn, sn = (
            np.cos(self.inclination),
            np.sin(self.inclination),
            np.cos(self.node),
            np.sin(self.node),
        )
        x, y = self.radius * np.cos(u), self.radius * np.sin(u)
        return np.array([cn * x - sn * ci * y, sn * x + cn * ci * y, si * y])

    def velocity(self, t):
        h = 1e-3
        return (self.at(t - 2 * h) - 8 * self.at(t - h) + 8 * self.at(t + h) - self.at(t + 2 * h)) / (12 * h)


def constellation(gps=24, glonass=24):
    """Satellite index -> orbit: six GPS and three GLONASS planes, evenly filled."""
    found = {}
    for first, count, planes, radius, inclination in (
        (1, gps, 6, 26_560e3, 55),
        (65, glonass, 3, 25_510e3, 64.8),
    ):
        in_plane = -(-count // planes)
        for k in range(count):
            plane, slot = k % planes, k // planes
            phase = 2 * np.pi * (slot / in_plane + plane / (planes * in_plane)) + 0.1 * first
            found[first + k] = Circle(radius, np.radians(inclination), 2 * np.pi * plane / planes, phase)
    return found


def cross_matrix(v):
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0.0]])


def turned(dcm, rate, t):
    """DCM after turning at a constant body rate: exp(-[w t]) dcm, by Rodrigues."""
    angle = np.linalg.norm(rate) * t
    if angle == 0:
        return dcm
    k = cross_matrix(np.asarray(rate) / np.linalg.norm(rate))
    return (np.eye(3) - np.sin(angle) * k + (1 - np.cos(angle)) * k @ k) @ dcm


def quaternion(dcm):
    """Unit quaternion, scalar first, of a passive DCM, by its largest component."""
    trace = np.trace(dcm)
    four = np.array([trace, *np.diag(dcm)])
    i = int(np.argmax(four))
    if i == 0:
        q = np.array([1 + trace, dcm[1, 2] - dcm[2, 1], dcm[2, 0] - dcm[0, 2], dcm[0, 1] - dcm[1, 0]])
    else:
        j, k = i % 3 + 1, (i + 1) % 3 + 1
        q = np.zeros(4)
        a, b, c = i - 1, j - 1, k - 1
        q[0] = dcm[b, c] - dcm[c, b]
        q[i] = 1 + dcm[a, a] - dcm[b, b] - dcm[c, c]
        q[j] = dcm[a, b] + dcm[b, a]
        q[k] = dcm[a, c] + dcm[c, a]
    return q / np.linalg.norm(q)


@dataclass(frozen=True)
class Craft:
    """A craft with antennas; body frame turning at a constant inertial rate from `dcm_body_from_eci`."""

    orbit: Circle
    lever_body: np.ndarray
    dcm_body_from_eci: np.ndarray
    rate_body: np.ndarray
    clock_s: np.ndarray  # (domains,) at T0
    clock_rate: np.ndarray  # (domains,) s/s
    domain: np.ndarray  # (m,)
    glonass_offset_s: float = 0.0

    def dcm_eci(self, t):
        return turned(self.dcm_body_from_eci, self.rate_body, t)

    def antenna(self, a, t):
        return self.orbit.at(t) + self.dcm_eci(t).T @ self.lever_body[a]


def shown(craft, domain, t):
    """The instant at which a domain's clock shows t."""
    return (t - craft.clock_s[domain]) / (1 + craft.clock_rate[domain])


SAT_CLOCK_S = 3.7e-5
SAT_DRIFT = 4e-11


def satellite_clock(sat, t):
    """(clock [s], rate) of a satellite at transmission."""
    return SAT_CLOCK_S * np.sin(sat) + SAT_DRIFT * np.cos(sat) * t, SAT_DRIFT * np.cos(sat)


def shapiro(a, b):
    r, s, d = np.linalg.norm(a), np.linalg.norm(b), np.linalg.norm(a - b)
    return 2 * MU / C**2 * np.log((r + s + d) / (r + s - d))


def transmission(orbit, antenna, t):
    tau = 0.07
    for _ in range(8):
        d = np.linalg.norm(orbit.at(t - tau) - antenna)
        tau = (d + shapiro(antenna, orbit.at(t - tau))) / C
    return tau


def pseudorange(craft, a, sat, orbit, t):
    """c (t_receive - t_transmit) in raw clocks, the receiver latching at true time t."""
    tau = transmission(orbit, craft.antenna(a, t), t)
    d = craft.domain[a]
    receiver = craft.clock_s[d] + craft.clock_rate[d] * t + craft.glonass_offset_s * (sat >= 64)
    return C * (tau + receiver - satellite_clock(sat, t - tau)[0])


def rate(craft, a, sat, orbit, t, h=0.2):
    p = [pseudorange(craft, a, sat, orbit, t + k * h) for k in (-2, -1, 1, 2)]
    return (p[0] - 8 * p[1] + 8 * p[2] - p[3]) / (12 * h)


def observe(craft, pairs, sky, t=0.0, rates=True):
    """Rows of every (antenna, satellite) of `pairs`: dict of arrays as a receiver reports them."""
    rows = []
    for a, sat in pairs:
        orbit = sky[sat]
        tau = transmission(orbit, craft.antenna(a, t), t)
        to_ecef = ecef_from_eci(t - tau)
        inertial = orbit.at(t - tau)
        velocity = to_ecef @ (orbit.velocity(t - tau) - np.cross([0, 0, W], inertial))
        clock, drift = satellite_clock(sat, t - tau)
        rows.append(
            (a, sat, pseudorange(craft, a, sat, orbit, t), rate(craft, a, sat, orbit, t) if rates else 0.0,
             *(to_ecef @ inertial), *velocity, C * clock, C * drift)
        )  # fmt: skip
    names = ("antenna", "sat", "p", "pdot", "x", "y", "z", "vx", "vy", "vz", "clock", "drift")
    columns = np.array(rows, float).T.reshape(len(names), len(rows))
    return dict(zip(names, columns, strict=True))


def truth_ecef(craft, t=0.0):
    """Position and velocity of the centre of mass in the Greenwich frame."""
    to_ecef = ecef_from_eci(t)
    r = craft.orbit.at(t)
    return to_ecef @ r, to_ecef @ (craft.orbit.velocity(t) - np.cross([0, 0, W], r))


def lvlh(orbit, t=0.0):
    """Body from inertial: x fore, y starboard, z nadir."""
    r, v = orbit.at(t), orbit.velocity(t)
    z = -r / np.linalg.norm(r)
    y = np.cross(v, r)
    y /= np.linalg.norm(y)
    return np.array([np.cross(y, z), y, z])


def clear(antenna, satellite, height=50e3):
    """Whether the segment stays clear of a sphere, by its closest point."""
    line = satellite - antenna
    s = np.clip(-(antenna @ line) / (line @ line), 0, 1)
    return np.linalg.norm(antenna + s * line) > 6378137.0 + height
