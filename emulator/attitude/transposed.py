"""Whether a table of attitudes was read the wrong way round: by what a craft keeps still in its body axes.

A craft keeps something still, the Earth's centre or the Sun as a rule. Where neither keeps its place in the
body axes of a table, and one would if every quaternion were conjugate, the table is of the other convention.
A remark and no more: a craft may turn as it likes.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.attitude.table import TabulatedAttitude
from gnss_hil.emulator.earth import frames, sun_moon
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.orbits.motion import Motion

STILL_RAD, MOVING_RAD = np.radians((5.0, 15.0))
_SAMPLES = 60


def wander_rad(directions: F64) -> float:
    """How far directions (k, 3) are from their middle, in the median [rad]; pi where they have none."""
    unit = directions / np.linalg.norm(directions, axis=1)[:, None]
    middle = unit.mean(axis=0)
    length = np.linalg.norm(middle)
    if length < 1e-9:
        return np.pi
    return float(np.median(np.arccos(np.clip(unit @ middle / length, -1.0, 1.0))))


def wanders_rad(body_from_eme2000: F64, nadir: F64, sun: F64) -> dict[str, float]:
    """How far the Earth's centre and the Sun wander in body axes, by name.

    body_from_eme2000   (k, 3, 3);  nadir, sun   (k, 3) directions, EME2000
    """
    both = {"the Earth's centre": nadir, "the Sun": sun}
    return {
        name: wander_rad(np.einsum("kij,kj->ki", body_from_eme2000, towards))
        for name, towards in both.items()
    }


def remark(
    table: TabulatedAttitude, motion: Motion, span_ns: tuple[int, int], measured: Orientation | None
) -> str | None:
    """A line on a table that looks transposed over a run; None where there is nothing to say."""
    t_ns: I64 = np.linspace(*span_ns, _SAMPLES).astype(np.int64)
    turned = np.stack([table.body_from_eme2000(t) for t in t_ns.tolist()])
    eme2000_from_ecef = np.swapaxes(frames.ecef_from_eme2000(t_ns, measured), 1, 2)
    nadir = -np.einsum("kij,kj->ki", eme2000_from_ecef, motion.over(t_ns).pos_ecef_m)
    # Axes of J2000 and of the GCRS are 0.02 arcsec apart.
    sun = sun_moon.sun_gcrs_m(t_ns)
    as_read = wanders_rad(turned, nadir, sun)
    conjugate = wanders_rad(np.swapaxes(turned, 1, 2), nadir, sun)
    if min(as_read.values()) <= STILL_RAD:
        return None
    for name, here_rad in as_read.items():
        if here_rad >= MOVING_RAD and conjugate[name] <= STILL_RAD:
            here, there = np.degrees((here_rad, conjugate[name]))
            return (
                f"{name} wanders by {here:.0f} deg in body axes, and by {there:.1g} deg with the quaternions "
                "read the other way round: is the convention right?"
            )
    return None
