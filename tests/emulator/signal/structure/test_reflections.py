"""Reflections against Fermat's principle, coefficients of the library tmm, and a traced bundle of rays."""

from math import sqrt

import numpy as np
import pytest
import tmm
from scipy.optimize import minimize

from gnss_hil.emulator.signal.structure import file, reflections
from gnss_hil.emulator.signal.structure.bodies import bodies_at, faces_at, structure
from gnss_hil.emulator.signal.structure.materials import MATERIALS, circular, coherent, fresnel
from gnss_hil.emulator.signal.structure.reflections import Pairs
from gnss_hil.emulator.signal.structure.shadowing import hits

RNG = np.random.default_rng(9)
WAVE_M = 0.1903
FAR_M = 2e7
ISS = structure(file.load(file.find("iss")))
ANTENNAS_M = np.array([[-24.0, 0.8, -0.435], [-29.0, -1.2, -0.99], [0.0, 6.0, -9.0]])


def unit(count):
    vectors = RNG.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def iss(sun):
    bodies = bodies_at(ISS, sun, 0.0)
    return bodies, faces_at(ISS.surfaces, bodies)


def all_pairs(m, n):
    return np.repeat(np.arange(m), n), np.tile(np.arange(n), m)


def fermat(faces, face, antenna_m, los):
    """Point of stationary path length from a satellite 20,000 km away over a face's plane, along its edges,
    and the path difference; lengths of the far leg as projections plus their second order."""

    edges = np.stack((faces.first[face], faces.second[face]))

    def path(uv):
        """Length, and how it changes along the edges."""
        place = faces.centre_m[face] + uv @ edges
        along, leg = place @ los, place - antenna_m
        aside, length = place - along * los, sqrt(leg @ leg)
        return length - along + aside @ aside / (2 * FAR_M), edges @ (leg / length - los + aside / FAR_M)

    found = minimize(path, np.zeros(2), method="BFGS", jac=True, options={"gtol": 1e-10})
    direct = -antenna_m @ los + ((antenna_m - antenna_m @ los * los) ** 2).sum() / (2 * FAR_M)
    return found.x, path(found.x)[0] - direct


@pytest.mark.slow(seconds=10)
@pytest.mark.verifies(
    "emulator/signal/structure/reflections.py",
    what="Reflections: place and path",
    by=(
        "Fermat's principle by SciPy's minimiser over every face of the ISS (0.1 mm); a bundle of rays "
        "traced at a cylinder. Single reflections of whole faces, edges diffract nothing"
    ),
    status="validated",
)
@pytest.mark.parametrize("sun", unit(2))
def test_reflections_are_where_fermat_finds_them(sun):
    """Every face of the ISS with antenna and satellite in front: found if and only if the shortest way over
    its plane touches inside its edges and both legs are clear; then with the same path difference."""
    bodies, faces = iss(sun)
    los = unit(14)
    antenna, satellite = all_pairs(len(ANTENNAS_M), len(los))
    seen = reflections.find(bodies, faces, ANTENNAS_M, los, Pairs(antenna, satellite))
    delay = {(p, f): d for p, f, d in zip(seen.pair, seen.face, seen.delay_m, strict=True)}
    compared = 0
    for pair, (a, s) in enumerate(zip(antenna, satellite, strict=True)):
        height = ((ANTENNAS_M[a] - faces.centre_m) * faces.normal).sum(axis=1)
        for face in np.flatnonzero((height > 1e-5) & (faces.normal @ los[s] > 0.02)):
            half = ISS.surfaces.half_m[face]
            uv, path_m = fermat(faces, face, ANTENNAS_M[a], los[s])
            margin = (np.abs(uv) - half).max()
            if abs(margin) < 1e-3:
                continue
            point = faces.centre_m[face] + uv[0] * faces.first[face] + uv[1] * faces.second[face]
            leg = point - ANTENNAS_M[a]
            length = np.linalg.norm(leg)
            clear = not hits(bodies, ANTENNAS_M[a], leg / length, np.array(length - 1e-3)).any()
            clear = clear and not hits(bodies, point + 1e-3 * faces.normal[face], los[s]).any()
            assert ((pair, face) in delay) == (margin < 0 and clear)
            if (pair, face) in delay:
                assert delay[pair, face] == pytest.approx(path_m, abs=1e-4)
                compared += 1
    assert compared >= 8


def test_mirrored_point():
    """The delay is the way to the antenna's mirror image, and the ray seems to come from there."""
    bodies, faces = iss(unit(1)[0])
    los = unit(40)
    antenna, satellite = all_pairs(len(ANTENNAS_M), len(los))
    seen = reflections.find(bodies, faces, ANTENNAS_M, los, Pairs(antenna, satellite))
    a, s = antenna[seen.pair], satellite[seen.pair]
    normal, centre = faces.normal[seen.face], faces.centre_m[seen.face]
    mirror = np.eye(3) - 2 * normal[:, :, None] * normal[:, None, :]
    image = centre + np.einsum("kij,kj->ki", mirror, ANTENNAS_M[a] - centre)
    np.testing.assert_allclose(seen.delay_m, ((ANTENNAS_M[a] - image) * los[s]).sum(axis=1), atol=1e-10)
    np.testing.assert_allclose(seen.towards_body, np.einsum("kij,kj->ki", mirror, los[s]), atol=1e-12)
    again = reflections.delays_m(faces, seen.face, ANTENNAS_M[a], los[s])
    np.testing.assert_allclose(again, seen.delay_m, atol=1e-10)


def test_what_an_antenna_stands_on_is_left_to_its_pattern():
    bodies, faces = iss(np.array((0.0, 0, -1)))
    los = np.array([[0.0, 0.1, -1.0]]) / np.hypot(0.1, 1)
    pairs = Pairs(np.zeros(1, np.int64), np.zeros(1, np.int64))
    near = reflections.find(bodies, faces, ANTENNAS_M, los, pairs)
    far = reflections.find(bodies, faces, ANTENNAS_M, los, pairs, nearest_m=0.5)
    assert "zvezda small diameter" in {ISS.names[b] for b in ISS.surfaces.body[near.face]}
    assert "zvezda small diameter" not in {ISS.names[b] for b in ISS.surfaces.body[far.face]}


@pytest.mark.verifies(
    "emulator/signal/structure/materials.py",
    what="Reflection coefficients, roughness",
    by="the library tmm, 1e-9; Brewster's angle; random heights. Materials of P.2040 typed from memory",
    status="validated",
)
@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("angle_deg", [0, 20, 45, 68, 85])
def test_fresnel_is_that_of_tmm(name, angle_deg):
    """tmm by S. Byrnes, whose time runs the other way: conjugate."""
    permittivity, angle = MATERIALS[name].permittivity, np.deg2rad(angle_deg)
    index = np.sqrt(np.conj(permittivity))
    inside = tmm.snell(1, index, angle)
    te, tm = fresnel(np.array([permittivity]), np.array([np.cos(angle)]))
    assert te[0] == pytest.approx(np.conj(tmm.interface_r("s", 1, index, angle, inside)), abs=1e-9)
    assert tm[0] == pytest.approx(np.conj(tmm.interface_r("p", 1, index, angle, inside)), abs=1e-9)


def test_hands():
    """A conductor turns the hand round; at Brewster's angle of a lossless dielectric both hands are equally
    strong; grazing, the hand stays."""
    right, left = circular(np.array([MATERIALS["metal"].permittivity]), np.array([0.6]))
    assert abs(left[0]) == pytest.approx(1, abs=1e-3)
    assert abs(right[0]) < 1e-3
    brewster = np.cos(np.arctan(np.sqrt(4.0)))
    right, left = circular(np.array([4.0 + 0j]), np.array([brewster]))
    assert abs(right[0]) == pytest.approx(abs(left[0]))
    right, left = circular(np.array([4.0 + 0j]), np.array([1e-6]))
    assert abs(right[0]) == pytest.approx(1, abs=1e-4)
    assert abs(left[0]) < 1e-4


def test_roughness_is_the_mean_phase_of_random_heights():
    heights = RNG.normal(0, 0.012, 400_000)
    mean = np.exp(4j * np.pi * heights * 0.7 / WAVE_M).mean()
    assert coherent(0.012, 0.7, WAVE_M) == pytest.approx(abs(mean), abs=3e-3)


@pytest.mark.parametrize(("incidence_deg", "azimuth_deg"), [(0, 0), (30, 0), (30, 90), (50, 35), (70, 60)])
def test_a_cylinder_spreads_a_bundle_of_rays(incidence_deg, azimuth_deg):
    """Rays of a plane wave around the central one, reflected at the cylinder itself and caught by a plane
    across the central ray: power falls as the bundle's area grows, amplitude as its root."""
    radius, distance, width = 2.0, 7.0, 1e-4
    theta, phi = np.deg2rad(incidence_deg), np.deg2rad(azimuth_deg)
    # Axis along x, central ray meets the top line (0, 0, radius); azimuth 0: in the plane of the axis.
    los = np.array((np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)))
    side = np.linalg.qr(np.column_stack((los, np.eye(3)[:, 0] + 0.3)))[0][:, 1]
    other = np.cross(los, side)
    top = np.array((0, 0, radius))
    exits = [bounce(top + width * (i * side + j * other), los, radius) for i, j in ((0, 0), (1, 0), (0, 1))]
    centre, ahead = exits[0]
    caught = []
    for place, way in exits:
        caught.append(place + way * (((centre + distance * ahead) - place) @ ahead) / (way @ ahead))
    area = np.linalg.norm(np.cross(caught[1] - caught[0], caught[2] - caught[0]))
    text = (
        'name = "x"\n[[box]]\nname = "can"\ncentre_m = [0.0, 0.0, 0.0]\n'
        f"size_m = [20.0, {2 * radius}, {2 * radius}]\nradius_m = {radius}\n"
    )
    can = structure(file.parse(text, "x"))
    faces = faces_at(can.surfaces, can.at_zero)
    antenna = (centre + distance * ahead)[None]
    first = np.zeros(1, np.int64)
    seen = reflections.find(can.at_zero, faces, antenna, los[None], Pairs(first, first))
    top_face = seen.face[np.isclose(faces.normal[seen.face, 2], 1)]
    assert len(top_face) == 1
    found = reflections.spreading(faces, seen)[seen.face == top_face[0]]
    assert found[0] == pytest.approx(width / np.sqrt(area), rel=1e-3)


def bounce(place, los, radius):
    """Where a ray against -los through a place meets a cylinder about x, and where it goes."""
    way = -los
    a, b = way[1:] @ way[1:], 2 * (place[1:] @ way[1:])
    c = place[1:] @ place[1:] - radius**2
    hit = place + way * (-b - np.sqrt(max(b * b - 4 * a * c, 0.0))) / (2 * a)
    normal = np.array((0, hit[1], hit[2])) / radius
    return hit, way - 2 * (way @ normal) * normal


@pytest.mark.verifies(
    "emulator/signal/structure/reflections.py",
    what="Polarisation of reflections at the antenna",
    by="one cross-polar ratio in all directions, left- and right-handed patterns in phase",
    status="modelled",
)
def test_strength_by_hand():
    """A metal wall: pattern, cross polarisation, amplitude of the surface, half a turn."""
    text = (
        'name = "x"\n[[panel]]\nname = "wall"\ncentre_m = [0.0, 5.0, 0.0]\nnormal_body = [0.0, -1.0, 0.0]\n'
        "along_body = [1.0, 0.0, 0.0]\nsize_m = [40.0, 40.0]\namplitude = 0.5\n"
    )
    wall = structure(file.parse(text, "x"))
    faces = faces_at(wall.surfaces, wall.at_zero)
    los = np.array([[0.0, -0.6, -0.8]])
    first = np.zeros(1, np.int64)
    seen = reflections.find(wall.at_zero, faces, np.zeros((1, 3)), los, Pairs(first, first))
    assert seen.delay_m[0] == pytest.approx(2 * 5 * 0.6)

    def gain(antenna, direction):
        return np.where(direction[:, 1] > 0, -2.0, 3.0)

    strength = reflections.coefficients(faces, seen, first, los, np.array([WAVE_M]), gain, 12.0)
    assert abs(strength[0]) == pytest.approx(0.5 * 10 ** (-(5 + 12) / 20), rel=1e-3)
    assert abs(np.angle(strength[0])) == pytest.approx(np.pi, abs=1e-3)
