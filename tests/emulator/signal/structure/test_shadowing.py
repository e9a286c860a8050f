"""Shadows against a march along every ray."""

import numpy as np
import pytest

from gnss_hil.emulator.signal.structure.bodies import Bodies
from gnss_hil.emulator.signal.structure.shadowing import blocked, hits

RNG = np.random.default_rng(6)
STEP_M = 0.004


def unit(*shape):
    vectors = RNG.normal(size=(*shape, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def some_bodies(count, flat):
    axes = np.linalg.qr(RNG.normal(size=(count, 3, 3)))[0]
    half = RNG.uniform(0.3, 3, (count, 3))
    half[:flat, 2] = 0.0
    return Bodies(RNG.uniform(-8, 8, (count, 3)), axes, half)


def marched(bodies, origin, direction, length):
    """Smallest excess over each body's extents along the way, negative where a step is inside. For panels it
    is that over the edges where the coordinate along the normal changes its sign."""
    steps = np.arange(0.01, length, STEP_M)
    begun = np.einsum("bij,bj->bi", bodies.axes, origin - bodies.centre_m)
    local = begun + steps[:, None, None] * (bodies.axes @ direction)
    inside = (np.abs(local) - bodies.half_m).max(axis=2)
    flat = bodies.half_m[:, 2] == 0
    crossing = np.diff(np.sign(local[:, :, 2]), axis=0) != 0
    edge = (np.abs(local) - bodies.half_m)[:-1, :, :2].max(axis=2)
    crossed = np.where(crossing, edge, np.inf).min(axis=0)
    return np.where(flat, crossed, inside.min(axis=0))


@pytest.mark.slow
@pytest.mark.verifies(
    "emulator/signal/structure/shadowing.py",
    what="Shadows by the structure",
    by="march along every ray; solid angle of a plate. No diffraction",
    status="validated",
)
def test_slabs_agree_with_marching():
    """Rays that pass an edge closer than two steps are left to chance."""
    bodies, compared = some_bodies(12, 5), 0
    outside = [p for p in RNG.uniform(-9, 9, (40, 3)) if not _inside(bodies, p)][:4]
    for origin in outside:
        towards = bodies.centre_m + RNG.normal(size=(5, *bodies.centre_m.shape)) - origin
        for direction in (towards / np.linalg.norm(towards, axis=-1, keepdims=True)).reshape(-1, 3):
            excess = marched(bodies, origin, direction, 30.0)
            clear = np.abs(excess) > 2 * STEP_M
            found = hits(bodies, origin, direction)
            assert (found == (excess < 0))[clear].all()
            compared += np.count_nonzero(clear & found)
    assert compared > 100


def _inside(bodies, place):
    local = np.einsum("bij,bj->bi", bodies.axes, place - bodies.centre_m)
    return (np.abs(local) < bodies.half_m + 0.05).all(axis=1).any()


def test_a_leg_ends():
    """A leg that stops short of a body is clear; the same leg made longer is not."""
    bodies = Bodies(np.array([[5.0, 0, 0]]), np.eye(3)[None], np.array([[1.0, 1, 1]]))
    origin, ahead = np.zeros(3), np.array((1.0, 0, 0))
    assert hits(bodies, origin, ahead, np.array((3.9, 4.1)))[:, 0].tolist() == [False, True]
    assert not hits(bodies, origin, -ahead).any()


def test_rays_along_faces():
    """Directions with zeros: parallel to two pairs of planes, inside and outside of them; along a panel."""
    box = Bodies(np.zeros((1, 3)), np.eye(3)[None], np.array([[1.0, 1, 1]]))
    ahead = np.array((1.0, 0, 0))
    assert hits(box, np.array((-5.0, 0.99, 0.99)), ahead)[0]
    assert not hits(box, np.array((-5.0, 1.01, 0.0)), ahead)[0]
    panel = Bodies(np.zeros((1, 3)), np.eye(3)[None], np.array([[1.0, 1, 0]]))
    assert not hits(panel, np.array((-5.0, 0.0, 0.1)), ahead)[0]
    assert hits(panel, np.array((0.3, 0.2, 4.0)), np.array((0.0, 0, -1)))[0]


def test_a_plate_hides_its_solid_angle():
    """A square plate of side 2a seen from height h above its middle has a solid angle of
    4 arctan(a^2 / (h sqrt(2 a^2 + h^2))); one stood upon, nearly half the sphere."""
    half, height = 3.0, 2.0
    plate = Bodies(np.zeros((1, 3)), np.eye(3)[None], np.array([[half, half, 0.0]]))
    sky = unit(200_000)
    share = blocked(plate, np.array([[0, 0, -height]]), sky).mean()
    solid = 4 * np.arctan(half**2 / (height * np.sqrt(2 * half**2 + height**2)))
    assert share == pytest.approx(solid / (4 * np.pi), abs=4 * np.sqrt(0.12 * 0.88 / 200_000))
    standing = blocked(plate, np.array([[0, 0, -1e-5]]), sky[:2000])
    steep = np.abs(sky[:2000, 2]) > 0.01
    assert (standing[0] == (sky[:2000, 2] > 0))[steep].mean() > 0.99
