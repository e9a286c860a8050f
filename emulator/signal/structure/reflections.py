"""Reflections from the craft's own surfaces: where they are, how long, how strong.

Image method: an antenna sees in a plane face the mirror image of a satellite, if the ray to the image passes
through the face, and nothing stands in either leg's way. Faces reflect like mirrors or not at all: edges
diffract nothing, faces smaller than the first Fresnel zone reflect too much, and rays that are reflected
twice are left out (modelled).
Source of the geometry: Braasch, "Multipath Effects", in Global Positioning System: Theory and Applications I
(1996), ch. 14; path difference of a far source over a plane, 2 h cos(incidence).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import C128, F64, I64, Bool
from gnss_hil.emulator.signal.structure.bodies import Bodies, Faces
from gnss_hil.emulator.signal.structure.materials import circular, coherent
from gnss_hil.emulator.signal.structure.shadowing import START_M, stopped

Gain = Callable[[I64, F64], F64]
"""Gain [dBi] of antennas (k,) for right-handed waves from directions (k, 3), body axes."""


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """p pairs of an antenna and a satellite, rows of the two; instant (p,) of each, where bodies and faces
    are of several."""

    antenna: I64
    satellite: I64
    instant: I64 | None = None

    def __len__(self) -> int:
        return len(self.antenna)


@dataclass(frozen=True, slots=True, eq=False)
class Reflections:
    """k reflections, by pair of antenna and satellite.

    pair           (k,) number of the pair;  face (k,) number of the face
    place          (k,) row of the face among those of all instants: the number, where there is one instant
    delay_m        (k,) path beyond the direct one [m]
    distance_m     (k,) from the antenna to the point of reflection [m]
    cos_incidence  (k,) of the angle from the face's normal
    towards_body   (k, 3) unit vectors from the antenna to the point of reflection
    """

    pair: I64
    face: I64
    place: I64
    delay_m: F64
    distance_m: F64
    cos_incidence: F64
    towards_body: F64

    def __len__(self) -> int:
        return len(self.pair)

    def __getitem__(self, rows) -> Reflections:
        return Reflections(*(getattr(self, name)[rows] for name in self.__slots__))


def find(
    bodies: Bodies,
    faces: Faces,
    antenna_body_m: F64,
    los_body: F64,
    pairs: Pairs,
    nearest_m: float = START_M,
) -> Reflections:
    """All single reflections of p pairs of an antenna and a satellite.

    antenna_body_m   (m, 3) places of the antennas;  los_body (n, 3) unit vectors to the satellites, of
                     several instants one after another, as many of each
    nearest_m        a face whose plane is closer to an antenna is what it stands on, and belongs to its
                     receive pattern
    """
    antenna, satellite, instant = pairs.antenna, pairs.satellite, pairs.instant
    first = np.zeros(len(antenna), np.int64) if instant is None else instant
    of_antenna = first * len(antenna_body_m) + antenna
    height_m = _heights_m(antenna_body_m, faces.centre_m, faces.normal)
    cosine = _cosines(los_body, faces.normal)
    pair, face = np.nonzero((height_m > nearest_m)[of_antenna] & (cosine > 0)[satellite])
    distance_m = height_m[of_antenna[pair], face] / cosine[satellite[pair], face]
    rays = of_antenna[pair], satellite[pair], face
    kept = np.flatnonzero(_inside(faces, antenna_body_m, los_body, rays, distance_m))
    pair, face, distance_m = pair[kept], face[kept], distance_m[kept]
    a, s = antenna[pair], satellite[pair]
    place = first[pair] * len(faces.surfaces.body) + face
    height_m = height_m[of_antenna[pair], face]
    cosine = cosine[s, face]
    towards = los_body[s] - 2 * cosine[:, None] * _rows(faces.normal)[place]
    found = Reflections(pair, face, place, 2 * (height_m * cosine), distance_m, cosine, towards)
    met = None if instant is None else instant[pair]
    return found[_clear(bodies, met, found, antenna_body_m[a], los_body[s])]


def _rows(column: F64) -> F64:
    """Vectors (..., f, 3) of faces as rows, one instant after another."""
    return column.reshape(-1, 3)


def _heights_m(antenna_body_m: F64, centre_m: F64, along: F64) -> F64:
    """(m, f) how far antennas are from the faces' centres along vectors (..., f, 3); of several instants one
    after another."""
    reach_m = antenna_body_m @ along.swapaxes(-1, -2)
    return (reach_m - (centre_m * along).sum(axis=-1)[..., None, :]).reshape(-1, along.shape[-2])


def _cosines(los_body: F64, along: F64) -> F64:
    """(n, f) components of unit vectors to satellites (n, 3) along vectors (..., f, 3)."""
    by_instant = los_body.reshape(*along.shape[:-2], -1, 3)
    return (by_instant @ along.swapaxes(-1, -2)).reshape(-1, along.shape[-2])


def _inside(
    faces: Faces,
    antenna_body_m: F64,
    los_body: F64,
    rays: tuple[I64, I64, I64],
    distance_m: F64,
) -> Bool:
    """(k,) whether the point of reflection lies inside the face's edges.

    rays         antenna (of an instant), satellite and face (k,) of each
    distance_m   (k,) from the antenna to the face's plane along the reflected ray
    """
    antenna, satellite, face = rays
    inside = np.ones(len(face), bool)
    for side, edge in enumerate((faces.first, faces.second)):
        # A reflection leaves the component along the face as it is.
        place_m = _heights_m(antenna_body_m, faces.centre_m, edge)[antenna, face]
        place_m += distance_m * _cosines(los_body, edge)[satellite, face]
        inside &= np.abs(place_m) <= faces.surfaces.half_m[face, side]
    return inside


def _clear(bodies: Bodies, instant: I64 | None, found: Reflections, origin_m: F64, incoming: F64) -> Bool:
    """(k,) whether nothing stands in the way from antennas origin_m (k, 3) to the points of reflection, nor
    from there along incoming (k, 3) to the satellites."""
    point_m = origin_m + found.distance_m[:, None] * found.towards_body
    near = stopped(bodies, instant, origin_m, found.towards_body, found.distance_m)
    return ~(near | stopped(bodies, instant, point_m, incoming))


def delays_m(faces: Faces, place: I64, antenna_body_m: F64, los_body: F64) -> F64:
    """Path differences (k,) [m] of reflections at faces place (k,): 2 h cos(incidence).

    antenna_body_m, los_body   (k, 3) of the reflections' antennas and satellites
    """
    normal = _rows(faces.normal)[place]
    height_m = ((antenna_body_m - _rows(faces.centre_m)[place]) * normal).sum(axis=1)
    return 2 * height_m * (los_body * normal).sum(axis=1)


def spreading(faces: Faces, seen: Reflections) -> F64:
    """Amplitude (k,) that is left of a plane wave after a cylinder has spread it; 1 from flat faces.

    sqrt(rho / (rho + distance)), rho = R cos(incidence) / (2 sin^2 a), a between ray and cylinder's axis.
    Source: Kouyoumjian & Pathak, Proc. IEEE 62 (1974) 1448: reflected wave front, one radius infinite
    """
    radius_m = faces.surfaces.radius_m[seen.face]
    along = (_rows(faces.axis_body)[seen.place] * seen.towards_body).sum(axis=1)
    twice = 2 * (1 - along**2) * seen.distance_m
    return 1 / np.sqrt(1 + twice / (radius_m * seen.cos_incidence))


def coefficients(
    faces: Faces,
    seen: Reflections,
    antenna: I64,
    los_body: F64,
    wave_m: F64,
    gain_dbi: Gain,
    cross_polar_db: float,
) -> C128:
    """Complex amplitudes (k,) of reflections, relative to the direct ray unobstructed, without their delay.

    antenna (k,), los_body (k, 3), wave_m (k,)   of the reflections' pairs
    cross_polar_db   by how much the antenna receives a left-handed wave weaker than a right-handed one from
                     the same direction; both with the same phase (modelled)
    A perfect conductor turns the phase by pi and the hand of the wave round.
    """
    surfaces = faces.surfaces
    right, left = circular(surfaces.permittivity[seen.face], seen.cos_incidence)
    received = right + left * 10 ** (-cross_polar_db / 20)
    ratio = 10 ** ((gain_dbi(antenna, seen.towards_body) - gain_dbi(antenna, los_body)) / 20)
    smooth = coherent(surfaces.roughness_m[seen.face], seen.cos_incidence, wave_m)
    return -received * ratio * smooth * surfaces.amplitude[seen.face] * spreading(faces, seen)
