"""Signal paths against brute force in extended precision, on orbits known in closed form."""

from dataclasses import dataclass

import numpy as np
import pytest

from gnss_hil.emulator.signal import geometry

pytestmark = pytest.mark.verifies(
    "emulator/signal/geometry.py",
    what="Light time, Sagnac, Shapiro, range rate",
    by="80-bit brute force (1 um); quadrature of the potential",
    status="validated",
)

L = np.longdouble
C = L(299_792_458)
OMEGA = L("7.2921151467e-5")
MU = L("3.986004418e14")
NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)


@dataclass
class Circle:
    """A circular orbit in the inertial frame whose axes are those of ECEF at t = 0."""

    radius: float
    inclination: float
    node: float
    latitude: float

    def _angles(self, t):
        rate = np.sqrt(MU / L(self.radius) ** 3)
        return L(self.latitude) + rate * L(t), rate

    def _turn(self, along, across):
        c, s, i = np.cos(L(self.node)), np.sin(L(self.node)), L(self.inclination)
        return np.array(
            [c * along - s * np.cos(i) * across, s * along + c * np.cos(i) * across, np.sin(i) * across]
        )

    def pos(self, t):
        u, _ = self._angles(t)
        return L(self.radius) * self._turn(np.cos(u), np.sin(u))

    def vel(self, t):
        u, rate = self._angles(t)
        return L(self.radius) * rate * self._turn(-np.sin(u), np.cos(u))

    def acc(self, t):
        _, rate = self._angles(t)
        return -(rate**2) * self.pos(t)


@dataclass
class Ecef:
    pos_ecef_m: np.ndarray
    vel_ecef_mps: np.ndarray
    acc_ecef_mps2: np.ndarray


def ecef(circles):
    """ECEF states (p, 3) at t = 0: what a sky or an orbit delivers."""
    w = np.array([L(0), L(0), OMEGA])
    rows = []
    for c in circles:
        pos = c.pos(0)
        vel = c.vel(0) - np.cross(w, pos)
        acc = c.acc(0) - 2 * np.cross(w, vel) - np.cross(w, np.cross(w, pos))
        rows.append((pos, vel, acc))
    return Ecef(*(np.array(part, float) for part in zip(*rows, strict=True)))


def shapiro_by_quadrature(tx, rx):
    """2 mu / c^2 times the integral of ds / r along the straight line."""
    points = rx + np.outer((L(1) + NODES) / 2, tx - rx)
    length = np.sqrt(((tx - rx) ** 2).sum())
    return 2 * MU / C**2 * length / 2 * (WEIGHTS / np.sqrt((points**2).sum(axis=1))).sum()


def flight_by_iteration(satellite, receiver, t, shapiro=True):
    flight = L(0)
    for _ in range(12):  # each leaves some 1e-5 of the error before it
        tx, rx = satellite.pos(t - flight), receiver.pos(t)
        length = np.sqrt(((tx - rx) ** 2).sum())
        flight = (length + (shapiro_by_quadrature(tx, rx) if shapiro else 0)) / C
    return flight


CRAFT = Circle(6.793e6, np.deg2rad(51.6), 0.3, 0.8)
SATELLITES = [
    Circle(26.5597e6, np.deg2rad(55), node, latitude)
    for node, latitude in ((0.2, 0.9), (1.2, 0.4), (-0.8, 1.4), (0.3, -0.4))
] + [Circle(25.508e6, np.deg2rad(64.8), 0.9, 1.3), Circle(42.164e6, 0.0, 1.0, 0.1)]


@pytest.fixture(scope="module")
def paths():
    satellites, craft = geometry.inertial(ecef(SATELLITES)), geometry.inertial(ecef([CRAFT]))
    p = len(SATELLITES)
    return geometry.path(satellites, np.repeat(craft.pos_m, p, 0), np.repeat(craft.vel_mps, p, 0))


def test_path_length_equals_brute_force_to_a_micrometre(paths):
    exact = [float(C * flight_by_iteration(s, CRAFT, L(0))) for s in SATELLITES]
    assert np.abs(paths.length_m - exact).max() < 1e-6
    assert np.allclose(paths.flight_s * float(C), paths.length_m, rtol=1e-15)


def test_path_rate_equals_the_numerical_derivative(paths):
    h = L("0.25")
    for satellite, rate in zip(SATELLITES, paths.rate_mps, strict=True):
        f = {k: C * flight_by_iteration(satellite, CRAFT, k * h) for k in (-2, -1, 1, 2)}
        exact = (8 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12 * h)
        # 1e-5 m/s: the rate of the Shapiro delay, left out by intent
        assert abs(float(exact) - rate) < 1e-5


def test_rate_without_the_shapiro_term_is_exact():
    satellites, craft = geometry.inertial(ecef(SATELLITES[:1])), geometry.inertial(ecef([CRAFT]))
    rate = geometry.path(satellites, craft.pos_m, craft.vel_mps).rate_mps[0]
    h = L("0.25")
    f = {k: C * flight_by_iteration(SATELLITES[0], CRAFT, k * h, False) for k in (-2, -1, 1, 2)}
    exact = (8 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12 * h)
    assert abs(float(exact) - rate) < 1e-7


def test_earth_rotation_during_the_flight_is_in_the_path():
    """Receiver and satellite fixed in ECEF at the equator, 90 deg apart in longitude: light time computed
    without the rotation is wrong by omega |r_s x r_r| / c, the Sagnac effect."""
    radius, station = 42.164e6, 6.378137e6
    rest = Ecef(np.array([[0, radius, 0.0]]), np.zeros((1, 3)), np.zeros((1, 3)))
    ground = geometry.inertial(Ecef(np.array([[station, 0, 0.0]]), np.zeros((1, 3)), np.zeros((1, 3))))
    length = geometry.path(geometry.inertial(rest), ground.pos_m, ground.vel_mps).length_m[0]
    sagnac = float(OMEGA) * radius * station / float(C)
    shapiro = float(shapiro_by_quadrature(rest.pos_ecef_m[0].astype(L), ground.pos_m[0].astype(L)))
    assert sagnac == pytest.approx(65.4, abs=0.1)
    assert length - np.hypot(radius, station) - shapiro == pytest.approx(-sagnac, abs=1e-3)


def test_shapiro_delay_is_the_integral_of_the_potential():
    tx, rx = np.array([2.0e7, 1.5e7, 5e6]), np.array([6.7e6, -1e6, 2e5])
    closed = geometry.shapiro_m(*(np.linalg.norm(v) for v in (tx, rx, tx - rx)))
    assert closed == pytest.approx(float(shapiro_by_quadrature(tx.astype(L), rx.astype(L))), abs=1e-9)


def test_transmission_state_is_that_of_the_earlier_instant():
    """ECEF axes of the transmission instant, from the closed orbit turned by the Earth."""
    states = ecef(SATELLITES)
    flight = np.full(len(SATELLITES), 0.08)
    pos, vel = geometry.at_transmission(states, np.arange(len(SATELLITES)), flight)
    for row, satellite in enumerate(SATELLITES):
        angle = -OMEGA * L("0.08")
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        exact = turn @ satellite.pos(-L("0.08"))
        exact_vel = turn @ satellite.vel(-L("0.08")) - np.cross(np.array([0, 0, OMEGA]), exact)
        assert np.abs((pos[row] - exact).astype(float)).max() < 1e-6
        assert np.abs((vel[row] - exact_vel).astype(float)).max() < 1e-5


def test_antennas_turn_with_the_body():
    """Phase centres and their velocities against finite differences of a turning body."""
    state = ecef([CRAFT])
    craft = Ecef(state.pos_ecef_m[0], state.vel_ecef_mps[0], state.acc_ecef_mps2[0])
    rate_body = np.array([0.01, -0.02, 0.03])
    dcm = np.linalg.qr(np.array([[1, 2, 3], [0, 1, 4], [5, 6, 0.0]]))[0]
    dcm *= np.sign(np.linalg.det(dcm))
    lever = np.array([[2.4, 0.0, -1.1], [0.0, 3.0, 1.0]])
    bore = np.array([[0.0, 0.0, -1.0], [0.6, 0.0, -0.8]])
    found = geometry.antennas(craft, dcm, rate_body, lever, bore)
    assert np.allclose(found.pos_m - craft.pos_ecef_m, (dcm.T @ lever.T).T)
    assert np.allclose(found.boresight, (dcm.T @ bore.T).T)
    h = 1e-3
    half = rate_body * h  # body axes turn by rate * h: v_body(h) = (1 - [w h x]) v_body
    skew = np.array([[0, -half[2], half[1]], [half[2], 0, -half[0]], [-half[1], half[0], 0]])
    later, earlier = (np.eye(3) - skew + skew @ skew / 2) @ dcm, (np.eye(3) + skew + skew @ skew / 2) @ dcm
    turning = ((later.T - earlier.T) @ lever.T).T / (2 * h)
    centre = CRAFT.vel(0).astype(float)
    assert np.allclose(found.vel_mps - centre, turning, atol=1e-6)
