"""The world of receiver.py: 24 satellites and a craft on circular orbits; ranges by docs/contract.md.

All is a function of t_s, seconds since the start. (..., 3) are in ECEF axes of t_s unless said otherwise.
"""

import numpy as np

C, MU, L1_HZ = 299792458.0, 3.986004418e14, 1575.42e6
OMEGA = np.array([0.0, 0.0, 7.2921151467e-5])  # of the Earth [rad/s]
N = np.arange(24)  # orbits: radius [m], inclination, node and phase at the start [rad]; six planes of four
SATELLITES = 26.56e6, np.radians(55), N % 6 * np.pi / 3, N // 6 * np.pi / 2 + N % 6 * 0.5
CRAFT = 6.778e6, np.radians(51.6), 0.0, 0.0
SV_CLOCK_M = 1000.0 * (N - 12)  # to be added to the pseudorange


def clock_m(t_s):
    """The receiver's clock minus GPS time, times c: 100 us and drifting by 10 ns/s."""
    return C * (1e-4 + 1e-8 * t_s)


def orbit(t_s, radius_m, tilt, node, phase):
    """Positions [m] and velocities relative to the Earth [m/s], (..., 3)."""
    u, o, speed = phase + t_s * np.sqrt(MU / radius_m**3), node - t_s * OMEGA[2], np.sqrt(MU / radius_m)
    at_node = np.stack([np.cos(o), np.sin(o), 0 * o], -1)
    on_top = np.stack([-np.sin(o) * np.cos(tilt), np.cos(o) * np.cos(tilt), np.sin(tilt) + 0 * o], -1)
    cos, sin = np.cos(u)[..., None], np.sin(u)[..., None]
    r = radius_m * (cos * at_node + sin * on_top)
    return r, speed * (cos * on_top - sin * at_node) - np.cross(OMEGA, r)


def craft(t_s):
    """Centre of mass [m], velocity [m/s], body axes as rows (x fore, y starboard, z nadir), rates [rad/s]."""
    r, v = orbit(t_s, *CRAFT)
    nadir, fore = (x / np.linalg.norm(x) for x in (-r, v + np.cross(OMEGA, r)))
    rate = np.sqrt(MU / CRAFT[0] ** 3)  # about -y: the orbit's normal is port
    return r, v, np.array([fore, np.cross(nadir, fore), nadir]), (0.0, -rate, 0.0)


def quaternion(dcm):
    """(w, x, y, z) of the contract's C(q): 4 q q' has a row that is not small; normalised it is q."""
    m, trace = np.asarray(dcm), np.trace(dcm)
    wx = np.array([m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]])
    rows = np.empty((4, 4))
    rows[0, 0], rows[0, 1:], rows[1:, 0] = 1 + trace, wx, wx
    rows[1:, 1:] = m + m.T + (1 - trace) * np.eye(3)
    row = rows[np.argmax(np.diag(rows))]
    return row / np.linalg.norm(row)


def ranges(t_s, antenna):
    """What an antenna measures of all satellites at t_s.

    antenna  table of the vehicle file
    returns  pseudoranges [m] (24,), line of sight in body axes (24, 3), position and velocity (24, 3) at the
             transmission instant and in ECEF axes of it
    """
    r, _, dcm, _ = craft(t_s)
    a_m, flight_s = r + antenna["lever_arm_body_m"] @ dcm, np.full(len(N), 0.07)
    for _ in range(6):  # the satellite where it was, turned with the Earth since
        s_m, v_mps = orbit(t_s - flight_s, *SATELLITES)
        cos, sin = np.cos(OMEGA[2] * flight_s), np.sin(OMEGA[2] * flight_s)
        p_m = np.stack([cos * s_m[:, 0] + sin * s_m[:, 1], cos * s_m[:, 1] - sin * s_m[:, 0], s_m[:, 2]], -1)
        rho_m = np.linalg.norm(p_m - a_m, axis=1)
        flight_s = rho_m / C
    ends_m = np.linalg.norm(a_m) + np.linalg.norm(s_m, axis=1)
    shapiro_m = 2 * MU / C**2 * np.log((ends_m + rho_m) / (ends_m - rho_m))
    measured_m = rho_m + shapiro_m + clock_m(t_s) - SV_CLOCK_M
    return measured_m, (p_m - a_m) / rho_m[:, None] @ dcm.T, s_m, v_mps


def observe(t_s, antenna):
    """All satellites, rows (24,): pseudorange [m], its rate [m/s], phase [cycles], angle inside the antenna's
    mask [rad], position and velocity as `ranges` gives them.

    The rate is a central difference over 0.2 s, good to 1e-5 m/s; the phase is zero at the start.
    """
    before_m, after_m, first_m = (ranges(t, antenna)[0] for t in (t_s - 0.1, t_s + 0.1, 0.0))
    range_m, los_body, s_m, v_mps = ranges(t_s, antenna)
    off_axis = np.arccos(np.clip(los_body @ antenna["boresight_body"], -1, 1))
    above = np.radians(antenna["mask_deg"]) - off_axis
    return range_m, (after_m - before_m) / 0.2, (range_m - first_m) * L1_HZ / C, above, s_m, v_mps
