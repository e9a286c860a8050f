"""The structure as arrays: rectangular bodies, their faces, and where both are at an instant.

A panel is a body without thickness. Everything is in body axes of the craft, metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import C128, F64, I64
from gnss_hil.emulator.numerics.rotations import dcm_321
from gnss_hil.emulator.signal.structure import joints
from gnss_hil.emulator.signal.structure.file import Box, Panel, StructureError, StructureFile
from gnss_hil.emulator.signal.structure.materials import MATERIALS

_NORMAL = 2
"""Which of a panel's axes is its normal."""


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """b rectangular bodies at one instant, or at several (...).

    centre_m  (..., b, 3)
    axes      (..., b, 3, 3) unit vectors of each body's own axes, as rows
    half_m    (b, 3) half their extent along them; 0 along a panel's normal
    """

    centre_m: F64
    axes: F64
    half_m: F64

    def at(self, instant: I64) -> Bodies:
        """Those of instants (r,), of the several there are."""
        return Bodies(self.centre_m[instant], self.axes[instant], self.half_m)


@dataclass(frozen=True, slots=True, eq=False)
class Surfaces:
    """What does not change of f faces.

    body, axis, sign   (f,) the face looks along sign times that axis of that body
    half_m             (f, 2) half its extent along the body's next two axes, cyclically
    permittivity       (f,) complex, relative
    amplitude          (f,) part reflected like from a mirror, 0 to 1
    roughness_m        (f,) rms height
    radius_m           (f,) of the cylinder along the body's x axis that it stands for; inf if it is flat
    """

    body: I64
    axis: I64
    sign: F64
    half_m: F64
    permittivity: C128
    amplitude: F64
    roughness_m: F64
    radius_m: F64


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """f faces of surfaces at one instant, or at several (...): normal, first and second edge (..., f, 3) unit
    vectors; centre_m (..., f, 3); axis_body (..., f, 3) x axes of their bodies, along which cylinders lie."""

    surfaces: Surfaces
    normal: F64
    first: F64
    second: F64
    centre_m: F64
    axis_body: F64


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """A spacecraft's structure.

    names      (b,) of its bodies, boxes first
    at_zero    the bodies with all joints at zero
    joint      (b,) number of the joint that turns a body, -1 for none
    """

    name: str
    names: tuple[str, ...]
    at_zero: Bodies
    joint: I64
    joints: joints.Joints
    surfaces: Surfaces


def _frame(part: Box | Panel) -> tuple[F64, F64]:
    """Axes (3, 3) and half extents (3,) of a part."""
    if isinstance(part, Box):
        return dcm_321(*np.deg2rad(part.turn_deg)), np.array(part.size_m) / 2
    normal: F64 = np.array(part.normal_body) / np.linalg.norm(part.normal_body)
    along: F64 = np.array(part.along_body) - normal * np.dot(part.along_body, normal)
    along /= np.linalg.norm(along)
    return np.array((along, np.cross(normal, along), normal)), np.array((*part.size_m, 0.0)) / 2


def _surfaces(parts: tuple[Box | Panel, ...], half_m: F64) -> Surfaces:
    """Six faces of every box and two of every panel, the dull ones left out."""
    rows = [
        (number, axis, sign)
        for number, part in enumerate(parts)
        for axis in (range(3) if isinstance(part, Box) else (_NORMAL,))
        for sign in (1.0, -1.0)
        if part.amplitude > 0
    ]
    body = np.array([row[0] for row in rows], np.int64)
    axis = np.array([row[1] for row in rows], np.int64)
    owner = [parts[number] for number in body]
    radius = [
        part.radius_m if isinstance(part, Box) and part.radius_m and along else np.inf
        for part, along in zip(owner, axis, strict=True)
    ]
    return Surfaces(
        body,
        axis,
        np.array([row[2] for row in rows]),
        np.stack((half_m[body, (axis + 1) % 3], half_m[body, (axis + 2) % 3]), axis=1),
        np.array([MATERIALS[part.material].permittivity for part in owner], np.complex128),
        np.array([part.amplitude for part in owner]),
        np.array([part.roughness_m for part in owner]),
        np.array(radius),
    )


def structure(file: StructureFile) -> Structure:
    """The arrays of a structure file."""
    parts = file.parts
    frames = [_frame(part) for part in parts]
    half_m = np.array([half for _, half in frames])
    at_zero = Bodies(
        np.array([part.centre_m for part in parts]), np.array([axes for axes, _ in frames]), half_m
    )
    number = {joint.name: row for row, joint in enumerate(file.joint)}
    return Structure(
        file.name,
        tuple(part.name for part in parts),
        at_zero,
        np.array([number[part.joint] if part.joint else -1 for part in parts]),
        joints.joints(file.joint),
        _surfaces(parts, half_m),
    )


def moves(craft: Structure) -> bool:
    """Whether any of its bodies hangs on a joint."""
    return bool((craft.joint >= 0).any())


def bodies_at(craft: Structure, sun_body: F64, t_s: float | F64) -> Bodies:
    """Where a structure's bodies are, at one instant or at several (...).

    sun_body   (..., 3) direction of the Sun, body axes
    t_s        (...) since the start of the run [s], for joints of constant rate
    """
    if not moves(craft):
        return craft.at_zero
    moved, instants = np.flatnonzero(craft.joint >= 0), sun_body.shape[:-1]
    turn, shift_m = joints.turned(craft.joints, sun_body, t_s)
    by, zero = craft.joint[moved], craft.at_zero
    turn, shift_m = turn[..., by, :, :], shift_m[..., by, :]
    centre_m = np.broadcast_to(zero.centre_m, (*instants, *zero.centre_m.shape)).copy()
    axes = np.broadcast_to(zero.axes, (*instants, *zero.axes.shape)).copy()
    centre_m[..., moved, :] = np.einsum("...ij,...j->...i", turn, zero.centre_m[moved]) + shift_m
    axes[..., moved, :, :] = zero.axes[moved] @ turn.swapaxes(-1, -2)
    return Bodies(centre_m, axes, zero.half_m)


def faces_at(surfaces: Surfaces, bodies: Bodies) -> Faces:
    """Where the faces of these bodies are."""
    axes = bodies.axes[..., surfaces.body, :, :]
    row = np.arange(len(surfaces.body))
    normal = surfaces.sign[:, None] * axes[..., row, surfaces.axis, :]
    reach_m = bodies.half_m[surfaces.body, surfaces.axis]
    return Faces(
        surfaces,
        normal,
        axes[..., row, (surfaces.axis + 1) % 3, :],
        axes[..., row, (surfaces.axis + 2) % 3, :],
        bodies.centre_m[..., surfaces.body, :] + reach_m[:, None] * normal,
        axes[..., 0, :],
    )


def require_outside(craft: Structure, places: dict[str, F64], margin_m: float = 1e-6) -> None:
    """StructureError if a place (3,) is inside a box, all joints at zero: nothing would be seen from it."""
    bodies = craft.at_zero
    for name, place_m in places.items():
        off_m = np.abs(np.einsum("bij,bj->bi", bodies.axes, place_m - bodies.centre_m))
        inside = np.flatnonzero((off_m < bodies.half_m - margin_m).all(axis=1))
        if len(inside):
            raise StructureError(
                f"structure '{craft.name}': antenna '{name}' is inside '{craft.names[inside[0]]}'"
            )
