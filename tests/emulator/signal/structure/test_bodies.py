"""Turning arrays against SciPy's rotations and a search for the angle that faces the Sun."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from gnss_hil.emulator.signal.structure import file
from gnss_hil.emulator.signal.structure.bodies import bodies_at, faces_at, structure
from gnss_hil.emulator.signal.structure.joints import rotation

RNG = np.random.default_rng(4)
ISS = structure(file.load(file.find("iss")))
WINGS = [row for row, name in enumerate(ISS.names) if name.startswith("wing ") and "radiator" not in name]


def unit(count):
    vectors = RNG.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_rotations_are_scipys():
    axis, angle = unit(50), RNG.uniform(-7, 7, 50)
    expected = Rotation.from_rotvec(axis * angle[:, None]).as_matrix()
    np.testing.assert_allclose(rotation(axis, angle), expected, atol=1e-14)


@pytest.mark.parametrize("sun", unit(20))
def test_two_joints_face_the_sun(sun):
    """Alpha and beta together point every wing straight at the Sun."""
    bodies = bodies_at(ISS, sun, 0.0)
    np.testing.assert_allclose(bodies.axes[WINGS, 2] @ sun, 1.0, atol=1e-12)


@pytest.mark.verifies(
    "emulator/signal/structure/joints.py",
    what="Turning arrays",
    by="SciPy rotations; search for the angle that faces the Sun",
    status="validated",
)
@pytest.mark.parametrize("sun", unit(5))
def test_one_joint_turns_as_close_to_the_sun_as_it_can(sun):
    """Zvezda's arrays: the angle found by search over all turns about y."""
    number = ISS.names.index("zvezda array port")
    normal = bodies_at(ISS, sun, 0.0).axes[number, 2]

    def off(angle):
        return -(Rotation.from_rotvec([0, angle, 0]).apply([0, 0, -1]) @ sun)

    best = min((minimize_scalar(off, bounds=(a, a + 2.2)) for a in (-3.2, -1.1, 1.0)), key=lambda r: r.fun)
    assert normal @ sun == pytest.approx(-best.fun, abs=1e-9)


def test_what_hangs_on_joints_keeps_its_distances():
    """A wing's centre stays where it is on the truss that carries it; hinges do not move along themselves."""
    zero, turned = ISS.at_zero, bodies_at(ISS, unit(1)[0], 0.0)
    truss, wing = ISS.names.index("truss port"), ISS.names.index("wing port 31.7 aft")
    for bodies in (zero, turned):
        apart = bodies.centre_m[wing] - bodies.centre_m[truss]
        assert np.linalg.norm(apart) == pytest.approx(np.hypot(20.05, 7.0))
        axes = bodies.axes
        np.testing.assert_allclose(
            axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-12
        )
    assert turned.centre_m[truss] == pytest.approx(zero.centre_m[truss])
    still = np.flatnonzero(ISS.joint < 0)
    assert (turned.centre_m[still] == zero.centre_m[still]).all()


def test_constant_rate_and_fixed_angle():
    text = """name = "x"
[[joint]]
name = "mast"
point_m = [1.0, 0.0, 0.0]
axis_body = [0.0, 0.0, 1.0]
turns = "rate"
angle_deg = 30.0
rate_dps = 2.0
[[joint]]
name = "hinge"
point_m = [3.0, 0.0, 0.0]
axis_body = [0.0, 1.0, 0.0]
turns = "fixed"
angle_deg = -90.0
parent = "mast"
[[panel]]
name = "dish"
centre_m = [4.0, 0.0, 0.0]
normal_body = [1.0, 0.0, 0.0]
along_body = [0.0, 1.0, 0.0]
size_m = [1.0, 2.0]
joint = "hinge"
"""
    craft = structure(file.parse(text, "x"))
    found = bodies_at(craft, np.array((1.0, 0, 0)), 30.0)
    mast, hinge = Rotation.from_euler("z", 90, degrees=True), Rotation.from_euler("y", -90, degrees=True)
    place = mast.apply(hinge.apply([1.0, 0, 0]) + np.array((2.0, 0, 0))) + np.array((1.0, 0, 0))
    np.testing.assert_allclose(found.centre_m[0], place, atol=1e-12)
    np.testing.assert_allclose(found.axes[0, 2], mast.apply(hinge.apply([1.0, 0, 0])), atol=1e-12)


def test_faces_enclose_their_bodies():
    """Gauss: areas times normals of a closed box cancel, areas times heights make three times its volume."""
    bodies = bodies_at(ISS, unit(1)[0], 0.0)
    faces, half = faces_at(ISS.surfaces, bodies), ISS.surfaces.half_m
    area = 4 * half[:, :1] * half[:, 1:]
    for number, size in enumerate(bodies.half_m):
        mine = ISS.surfaces.body == number
        np.testing.assert_allclose((area * faces.normal)[mine].sum(axis=0), 0, atol=1e-9)
        heights = (faces.normal * (faces.centre_m - bodies.centre_m[ISS.surfaces.body]))[mine].sum(axis=1)
        assert (area[mine, 0] * heights).sum() == pytest.approx(3 * 8 * np.prod(size))


def test_several_instants_are_each_by_itself():
    sun, t_s = unit(5), np.arange(5) * 37.0
    together = bodies_at(ISS, sun, t_s)
    faces = faces_at(ISS.surfaces, together)
    for k in range(5):
        alone = bodies_at(ISS, sun[k], t_s[k])
        np.testing.assert_array_equal(together.axes[k], alone.axes)
        np.testing.assert_array_equal(together.centre_m[k], alone.centre_m)
        np.testing.assert_array_equal(faces.centre_m[k], faces_at(ISS.surfaces, alone).centre_m)
