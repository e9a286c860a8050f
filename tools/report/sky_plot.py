"""The sky as each antenna has it: angles off its boresight, and who tracks what is there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternions
from gnss_hil.flightsw.assignment.boresight_angles import clear_of_earth
from gnss_hil.tools.report.decimate import evenly

INSTANTS = 150
"""Instants at which the sky is looked at: a picture of some thousand points."""

_FRESH_NS = 120_000_000_000
"""An almanac prediction is carried on for this long."""

_AXES = (("fore", "aft"), ("starboard", "port"), ("nadir", "zenith"))


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Satellites with their places, (n,) rows.

    position_m    (n, 3) ECEF; nan velocity rules nothing out
    velocity_mps  (n, 3) relative to the Earth
    """

    t_ns: I64
    satellite: I64
    position_m: F64
    velocity_mps: F64

    def __getitem__(self, rows) -> Places:
        return Places(self.t_ns[rows], self.satellite[rows], self.position_m[rows], self.velocity_mps[rows])


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Satellites clear of the Earth, at the instants looked at, (n,) rows.

    instant    row of the instants (k,) looked at
    tracked    (n, m) by which receivers
    off_deg    (n, m) angle off the boresight of each antenna
    round_deg  (n, m) angle round the boresight, as `antenna_axes` counts it
    """

    t_ns: I64
    instant: I64
    satellite: I64
    tracked: Bool
    off_deg: F64
    round_deg: F64


def antenna_axes(boresight_body: F64) -> F64:
    """(3, 3) rows: up and right in the picture, and the boresight, in body axes.

    Up is where the body's x axis (fore) points as seen along the boresight; where the boresight is that axis,
    up is zenith. The picture is drawn as from outside, as a map: of a zenith antenna starboard is right.
    """
    fore, zenith = np.array([1.0, 0, 0]), np.array([0, 0, -1.0])
    toward = zenith if abs(boresight_body @ fore) > 0.99 else fore
    up = toward - (toward @ boresight_body) * boresight_body
    up /= np.linalg.norm(up)
    return np.stack([up, np.cross(up, boresight_body), boresight_body])


def side_names(boresight_body: F64) -> tuple[str, str, str, str]:
    """Body axes nearest to up, right, down and left in an antenna's picture."""
    up, right, _ = antenna_axes(boresight_body)
    return _axis_name(up), _axis_name(right), _axis_name(-up), _axis_name(-right)


def _axis_name(direction: F64) -> str:
    axis = int(np.abs(direction).round(9).argmax())
    return _AXES[axis][int(direction[axis] < 0)]


def angles_deg(boresight_body: F64, los_body: F64) -> tuple[F64, F64]:
    """Angles (n,) off a boresight (3,), and round it clockwise from up, of directions (n, 3) [deg]."""
    up, right, along = (los_body @ axis for axis in antenna_axes(boresight_body))
    return np.degrees(np.arctan2(np.hypot(up, right), along)), np.degrees(np.arctan2(right, up)) % 360


def look(
    t_ns: I64,
    craft_m: F64,
    quaternion: F64,
    boresight_body: F64,
    measured: Places,
    receiver: I64,
    almanac: Places,
) -> Sightings:
    """Sightings at instants t_ns (k,).

    craft_m         (k, 3) ECEF        quaternion   (k, 4) body from ECEF
    boresight_body  (m, 3)
    measured        channels at these instants, (c,), with receiver (c,) 1-based
    almanac         predictions; those at hand within two minutes say where the others are
    """
    none, blank = np.zeros(0, np.int64), np.zeros((0, len(boresight_body)))
    rows = [(none, none, blank.astype(bool), blank, blank)]
    for k, (now_ns, here_m, dcm) in enumerate(
        zip(t_ns, craft_m, dcm_of_quaternions(quaternion), strict=True)
    ):
        channels = np.flatnonzero(measured.t_ns == now_ns)
        satellite, first = np.unique(measured.satellite[channels], return_index=True)
        tracked = np.zeros((len(satellite), len(boresight_body)), bool)
        tracked[np.searchsorted(satellite, measured.satellite[channels]), receiver[channels] - 1] = True
        position = measured.position_m[channels[first]]
        idle, predicted = _predicted(almanac, now_ns)
        new = ~np.isin(idle, satellite)
        satellite, position = np.r_[satellite, idle[new]], np.r_[position, predicted[new]]
        tracked = np.r_[tracked, np.zeros((new.sum(), len(boresight_body)), bool)]
        away = position - here_m
        distance = np.linalg.norm(away, axis=1)
        los = away / distance[:, None]
        clear = clear_of_earth(los.T, distance, here_m, 0.0) | tracked.any(axis=1)
        angles = [angles_deg(boresight, los[clear] @ dcm.T) for boresight in boresight_body]
        rows.append((np.full(clear.sum(), k), satellite[clear], tracked[clear], *np.stack(angles, axis=-1)))
    instant, satellite, tracked, off, around = (np.concatenate(column) for column in zip(*rows, strict=True))
    return Sightings(t_ns[instant], instant, satellite, tracked, off, around)


def _predicted(almanac: Places, now_ns: int) -> tuple[I64, F64]:
    """Satellites and their places (n, 3) now, each from the almanac row nearest in time."""
    near = np.flatnonzero(np.abs(almanac.t_ns - now_ns) <= _FRESH_NS)
    near = near[np.argsort(np.abs(almanac.t_ns[near] - now_ns), kind="stable")]
    satellite, first = np.unique(almanac.satellite[near], return_index=True)
    rows = near[first]
    dt_s = (now_ns - almanac.t_ns[rows]) / 1e9
    return satellite, almanac.position_m[rows] + dt_s[:, None] * almanac.velocity_mps[rows]


def instants(usable: Bool, count: int = INSTANTS) -> I64:
    """Rows at which to look: evenly spread over those that are usable (n,)."""
    rows = np.flatnonzero(usable)
    return rows[evenly(len(rows), count)]


def places(rows: Mapping[str, NDArray]) -> Places:
    """From the almanac's columns (`results.almanac`); none of an empty one."""
    if not rows:
        empty = np.zeros(0, np.int64)
        return Places(empty, empty, np.zeros((0, 3)), np.zeros((0, 3)))
    position = np.column_stack([rows[f"{a}_m"] for a in "xyz"])
    return Places(rows["t_ns"], rows["sat"], position, np.column_stack([rows[f"v{a}_mps"] for a in "xyz"]))
