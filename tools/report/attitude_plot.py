"""How the craft was turned from the axes of its orbit: roll, pitch, yaw, as the bus and as truth has it."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternions
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.plot import Json, Plot, axis, piled
from gnss_hil.tools.report.time_series import NO_TRUTH, shades, trace
from gnss_hil.tools.results.figures import small

_NAMES = ("roll", "pitch", "yaw")
_LEAST_SPAN_DEG = 2.0
"""A craft that stands still is drawn still."""


def roll_pitch_yaw_deg(body_from_ecef: F64, axes: F64) -> F64:
    """(e, 3) turns about x, y, z that lead from the orbit's axes to the body's, yaw first, [deg].

    axes   (e, 3, 3) rows radial, along, cross. The orbit's x is along, z to the Earth, y completes them.

    Source: Diebel, Representing Attitude (2006), 5.6.6, Euler angle sequence (3, 2, 1)
    """
    radial, along, cross = np.moveaxis(axes, 1, 0)
    orbit = np.stack([along, -cross, -radial], axis=1)
    c = np.einsum("nij,nkj->nik", body_from_ecef, orbit)
    roll = np.arctan2(c[:, 1, 2], c[:, 2, 2])
    pitch = -np.arcsin(np.clip(c[:, 0, 2], -1, 1))
    yaw = np.arctan2(c[:, 0, 1], c[:, 0, 0])
    return np.degrees(np.column_stack([roll, pitch, yaw]))


def angle_between_arcsec(a: F64, b: F64) -> F64:
    """(e,) angles [arcsec] between two attitudes as quaternions (e, 4)."""
    product = np.abs(np.einsum("ni,ni->n", a, b))
    chord = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    return np.where(np.isnan(product), np.nan, 3600 * np.degrees(4 * np.arcsin(np.clip(chord / 2, 0, 1))))


def attitude(craft: Craft) -> Plot:
    title, t_ns = "Attitude", craft.t_ns
    bus, truth = craft.quaternion, craft.truth_quaternion
    if np.isnan(bus).all():
        return Plot.missing(title, "No attitude was heard on the bus.")
    if np.isnan(craft.axes).all():
        return Plot.missing(title, "The craft's place is not known, so it has no orbit to compare with.")
    turns = {"bus": roll_pitch_yaw_deg(dcm_of_quaternions(bus), craft.axes)}
    if np.isnan(turns["bus"]).all():
        return Plot.missing(title, "No epoch has both an attitude on the bus and an orbit to compare with.")
    if truth is not None:
        turns = {"truth": roll_pitch_yaw_deg(dcm_of_quaternions(truth), craft.axes)} | turns
    rows: list[tuple[Json, list[Json]]] = []
    for i, name in enumerate(_NAMES):
        lines = [trace(of, t_ns, _unwrapped(deg[:, i]), _COLOURS[of], line=_LINES[of])
                 for of, deg in turns.items()]  # fmt: skip
        rows.append((axis(f"{name} [deg]", range=_span(np.concatenate([v[:, i] for v in turns.values()]))),
                     lines))  # fmt: skip
    words = "Body axes from the orbit's (x along the motion, z to the Earth): yaw, then pitch, then roll."
    if truth is None:
        words += f" {NO_TRUTH}"
    else:
        off = angle_between_arcsec(bus, truth)
        rows.append((axis("bus - truth [arcsec]", rangemode="tozero"),
                     [trace("bus - truth", t_ns, off, "--accent", line={"width": 1})]))  # fmt: skip
        most = float(np.max(off, where=~np.isnan(off), initial=0))
        words += f" Angle between the bus and truth: {small(most)} arcsec at most."
    shapes, shaded = shades(craft)
    return Plot(title, f"{words} {shaded}", piled(t_ns, rows, shapes=shapes), height=100 + 100 * len(rows),
                wide=True)  # fmt: skip


_COLOURS = {"truth": "--second", "bus": "--accent"}
_LINES = {"truth": {"width": 3}, "bus": {"width": 1.5}}


def _unwrapped(deg: F64) -> F64:
    """With a gap where an angle leaves at 180 degrees and comes back at -180."""
    return np.where(np.abs(np.diff(deg, prepend=deg[:1])) > 180, np.nan, deg)


def _span(deg: F64) -> list[float]:
    low, high = float(np.nanmin(deg)), float(np.nanmax(deg))
    air = max(0.08 * (high - low), (_LEAST_SPAN_DEG - (high - low)) / 2, 0)
    return [low - air, high + air]
