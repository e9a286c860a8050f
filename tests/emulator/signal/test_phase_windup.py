"""Phase wind-up: fields of crossed dipoles, another implementation, whole turns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gnss_hil.emulator.signal import phase_windup

SUN_M = np.array((9506972057.890299, 143587026032.88312, -36688291830.020676))
CSSRLIB = [
    # satellite [m], antenna [m], east, north, wind-up [cycles]
    ((9655422, 22955535, 9232221), (-5036729, 3499218, 1725247),
     (-0.570559652, -0.821256162, 0.0), (0.223782709, -0.155470839, 0.962159091), -0.24554479737),
    ((-16370380, 17716858, 11114913), (-6051714, -1990583, 63018),
     (0.312459669, -0.949931027, 0.0), (0.009459523, 0.003111509, 0.999950417), -0.44665229266),
    ((-4402850, 20673107, 16082762), (-5165801, 2614075, 2659089),
     (-0.451516101, -0.892262972, 0.0), (0.374477331, -0.189498556, 0.907665702), -0.38061242906),
    ((23227563, -12196175, -4141413), (5802420, 1836937, 1883408),
     (-0.301817636, 0.953365677, 0.0), (-0.283569244, -0.089772687, 0.954740461), -0.06275929769),
    ((-7870892, -25236695, 2564359), (492949, -5549939, -3089469),
     (0.996078636, 0.088472318, 0.0), (0.043123299, -0.485510025, 0.873166878), -0.39106214575),
    ((-2008718, -26341514, -2739958), (3372768, -4111751, 3508216),
     (0.773163396, 0.634206877, 0.0), (-0.350863596, 0.427738801, 0.833027164), -0.28685545094),
]  # fmt: skip


@pytest.mark.verifies(
    "emulator/signal/phase_windup.py",
    what="Phase wind-up",
    by=(
        "cssrlib's (RTKLIB's) wind-up with the nominal attitude, six rays, 1e-7 cycles; sign and size by "
        "superposed fields; numerical derivative"
    ),
    status="validated",
)
@pytest.mark.parametrize("case", CSSRLIB)
def test_as_another_implementation_has_it(case):
    """cssrlib 1.2.1, `ppp.windupcorr(full=True)`: nominal attitude with the Sun of 2012-10-31, 06:00,
    antennas with x east and y north. (It follows RTKLIB, which takes x north and y west.)"""
    satellite, antenna, east, north, expected = (np.array(part, float) for part in case)
    along = (antenna - satellite) / np.linalg.norm(antenna - satellite)
    found = phase_windup.windup(along, phase_windup.satellite_axes(satellite, SUN_M), (east, north))
    assert found == pytest.approx(expected, abs=1e-7)


def received_phase(along, turned_tx, turned_rx):
    """Phase [cycles] of a right-handed wave between crossed dipoles that face each other, from fields.

    The transmitter's dipoles x, y are fed in quadrature, y a quarter of a cycle late, so that the field turns
    from x to y, right-handed about the way; the receiver adds what its dipoles hear in the same manner.
    """
    side = np.cross(along, (0.3, 0.5, -0.8))
    side /= np.linalg.norm(side)
    other = np.cross(along, side)
    x_tx, y_tx = (Rotation.from_rotvec(turned_tx * along).apply(v) for v in (side, other))
    # The antenna looks against the wave: its y is on the other side.
    x_rx, y_rx = (Rotation.from_rotvec(turned_rx * along).apply(v) for v in (side, -other))
    field = x_tx - 1j * y_tx  # exp(i w t) understood
    # Facing the wave, its field turns from x to -y; the receiver delays x behind y to add both in phase.
    voltage = field @ x_rx + field @ y_rx * np.exp(-1j * np.pi / 2)
    axes = (x_tx, y_tx), (x_rx, y_rx)
    return np.angle(voltage) / (2 * np.pi), axes


def test_facing_antennas_have_the_phase_of_their_fields():
    """Sign and size by superposed fields; a measured phase grows where the received one falls back."""
    rng = np.random.default_rng(5)
    for _ in range(30):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        phase, (transmit, receive) = received_phase(along, *rng.uniform(-3, 3, 2))
        off = phase_windup.windup(along, transmit, receive) + phase
        assert off - np.rint(off) == pytest.approx(0, abs=1e-12)


def test_an_antenna_turned_once_about_its_boresight_counts_one_cycle():
    """Right-handed about the way of the wave: one cycle more; the transmitter: one less."""
    along = np.array((0.0, 0.0, 1.0))
    axes = phase_windup.antenna_axes(-along[None])
    for who, whole in (("receive", 1.0), ("transmit", -1.0)):
        before = start = np.nan
        for angle in np.linspace(0, 2 * np.pi, 41):
            turn = Rotation.from_rotvec(angle * along)
            turned = tuple(turn.apply(axis[0]) for axis in axes)
            still_tx, still_rx = (np.array((1.0, 0, 0)), np.array((0, 1.0, 0))), tuple(a[0] for a in axes)
            if who == "receive":
                cycles = phase_windup.windup(along, still_tx, turned)
            else:
                cycles = phase_windup.windup(along, tuple(turn.apply(axis) for axis in still_tx), still_rx)
            before = phase_windup.unwrapped(cycles, before)
            start = before if np.isnan(start) else start
        assert before - start == pytest.approx(whole, abs=1e-12)


def test_antenna_axes_are_right_handed():
    boresight = np.array(((0, 0, 1.0), (0, 0.6, 0.8), (-1.0, 0, 0), (0.48, 0.6, 0.64)))
    x, y = phase_windup.antenna_axes(boresight)
    assert np.cross(x, y) == pytest.approx(boresight, abs=1e-15)
    assert np.linalg.norm(x, axis=1) == pytest.approx(1)


def test_solar_arrays_stand_square_to_the_sun():
    """Nominal yaw steering: z to the Earth, the Sun in the plane of x and z, on the side of x."""
    pos = np.array([case[0] for case in CSSRLIB], float)
    x, y = phase_windup.satellite_axes(pos, SUN_M)
    sunward = (SUN_M - pos) / np.linalg.norm(SUN_M - pos, axis=1, keepdims=True)
    assert np.einsum("nk,nk->n", y, sunward) == pytest.approx(0, abs=1e-15)
    assert (np.einsum("nk,nk->n", x, sunward) > 0).all()
    assert np.cross(x, y) == pytest.approx(-pos / np.linalg.norm(pos, axis=1, keepdims=True), abs=1e-15)


def test_the_rate_is_the_derivative():
    """A craft in a turn of 6 deg/s under satellites that move: against a fine table of wind-up."""
    turn_rps = np.array((0.02, -0.05, 0.09))
    pos_tx = np.array([case[0] for case in CSSRLIB], float)
    vel_tx = 3900 * np.cross((0.2, -0.5, 0.8), pos_tx) / 26.56e6
    pos_rx = np.array([case[1] for case in CSSRLIB], float) * 1.06
    vel_rx = 7700 * np.cross((0.6, 0.5, -0.6), pos_rx) / 6.75e6
    boresight = pos_rx / np.linalg.norm(pos_rx, axis=1, keepdims=True)
    axes = phase_windup.antenna_axes(boresight)

    def at(t):
        turned = tuple(Rotation.from_rotvec(turn_rps * t).apply(axis) for axis in axes)
        satellite, antenna = pos_tx + t * vel_tx, pos_rx + t * vel_rx
        along = (antenna - satellite) / np.linalg.norm(antenna - satellite, axis=1, keepdims=True)
        return phase_windup.windup(along, phase_windup.satellite_axes(satellite, SUN_M), turned)

    cycles, rate = phase_windup.windup_and_rate(pos_tx, vel_tx, SUN_M, pos_rx, vel_rx, axes, turn_rps)
    assert cycles == pytest.approx(at(0.0), abs=1e-12)
    step = at(1e-3) - at(-1e-3)
    assert rate == pytest.approx((step - np.rint(step)) / 2e-3, abs=2e-5)
    assert np.abs(rate).max() > 3e-3


def test_turns_are_counted_on_and_start_anew():
    before = np.array((0.45, -3.4, np.nan))
    assert phase_windup.unwrapped(np.array((-0.48, -0.38, 0.2)), before) == pytest.approx((0.52, -3.38, 0.2))


def test_a_sun_in_line_with_satellite_and_earth_leaves_numbers():
    pos = np.array(((26_560e3, 0.0, 0.0), (0.0, 26_560e3, 0.0)))
    axes = phase_windup.satellite_axes(pos, np.array((1.5e11, 0.0, 0.0)))
    assert np.isfinite(phase_windup.windup(-pos / 26_560e3, axes, axes)).all()
