"""Joints: how far they have turned, and where that takes what hangs on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.signal.structure.file import Joint


@dataclass(frozen=True, slots=True, eq=False)
class Joints:
    """j joints, all at zero.

    point_m, axis   (j, 3) a point on the axis [m] and its unit vector
    facing, across  (j, 3) unit vector to turn to the Sun, at right angles to the axis, and where a quarter of
                    a turn takes it; 0 where none is
    angle_rad       (j,) at the start;  rate_rps (j,) [rad/s]
    parent          (j,) number of the joint that carries it, -1 for the craft
    levels          numbers of the joints on the craft, on those, and so on
    """

    point_m: F64
    axis: F64
    facing: F64
    across: F64
    angle_rad: F64
    rate_rps: F64
    parent: I64
    levels: tuple[I64, ...]


def joints(rows: Sequence[Joint]) -> Joints:
    """The joints of a file; each comes after its parent."""
    number = {row.name: place for place, row in enumerate(rows)}
    parent = np.array([number[row.parent] if row.parent else -1 for row in rows], np.int64)
    depth = np.zeros(len(rows), np.int64)
    for place, carrier in enumerate(parent):
        depth[place] = depth[carrier] + 1 if carrier >= 0 else 0
    axis = np.array([row.axis_body for row in rows]).reshape(-1, 3)
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    facing = np.array([row.facing_body or (0.0, 0.0, 0.0) for row in rows]).reshape(-1, 3)
    facing = facing - (facing * axis).sum(axis=1, keepdims=True) * axis
    return Joints(
        np.array([row.point_m for row in rows]).reshape(-1, 3),
        axis,
        facing,
        np.cross(axis, facing),
        np.deg2rad([row.angle_deg for row in rows]),
        np.deg2rad([row.rate_dps for row in rows]),
        parent,
        tuple(np.flatnonzero(depth == level) for level in range(depth.max(initial=-1) + 1)),
    )


def rotation(axis: F64, angle_rad: F64) -> F64:
    """(..., j, 3, 3) active rotations about unit vectors (j, 3) by angles (..., j). Rodrigues' formula."""
    cos, sin = np.cos(angle_rad)[..., None, None], np.sin(angle_rad)[..., None, None]
    across = np.zeros((len(axis), 3, 3))
    across[:, 0, 1], across[:, 0, 2], across[:, 1, 2] = -axis[:, 2], axis[:, 1], -axis[:, 0]
    across -= across.transpose(0, 2, 1)
    return cos * np.eye(3) + sin * across + (1 - cos) * axis[:, :, None] * axis[:, None, :]


def turned(rows: Joints, sun_body: F64, t_s: float | F64) -> tuple[F64, F64]:
    """Where joints take what hangs on them: x -> turn x + shift, body axes.

    sun_body   (..., 3) direction of the Sun;  t_s (...) since the start of the run [s]
    returns    turn (..., j, 3, 3), shift (..., j, 3) [m]
    A joint that follows the Sun sees it from where its parents have brought it; there its facing direction
    comes closest to the Sun at the angle of the Sun's projection onto the plane of its turning. It does so
    through the Earth's shadow as well, without limits of rate or range (modelled).
    """
    count, instants = len(rows.parent), sun_body.shape[:-1]
    # The last row stands for the craft itself, which parent -1 finds.
    turn = np.broadcast_to(np.eye(3), (*instants, count + 1, 3, 3)).copy()
    shift_m = np.zeros((*instants, count + 1, 3))
    since_s = np.asarray(t_s)[..., None]
    for level in rows.levels:
        point_m, parent = rows.point_m[level], rows.parent[level]
        carrier, offset_m = turn[..., parent, :, :], shift_m[..., parent, :]
        sun = (sun_body[..., None, None, :] @ carrier)[..., 0, :]
        ahead, across = (sun * rows.facing[level]).sum(axis=-1), (sun * rows.across[level]).sum(axis=-1)
        angle = np.arctan2(across, ahead) + rows.angle_rad[level] + rows.rate_rps[level] * since_s
        own = rotation(rows.axis[level], angle)
        turn[..., level, :, :] = carrier @ own
        still_m = point_m - np.einsum("...ij,...j->...i", own, point_m)
        shift_m[..., level, :] = np.einsum("...ij,...j->...i", carrier, still_m) + offset_m
    return turn[..., :-1, :, :], shift_m[..., :-1, :]
