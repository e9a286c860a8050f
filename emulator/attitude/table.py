"""Attitude as flown: a table of quaternions relative to the axes of J2000.

Between two rows the body turns at one rate about one axis. The rates reported are those of the attitude that
is flown so, not the table's own.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.files.csv_table import Table
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternion, product, quaternion_of_dcm
from gnss_hil.emulator.orbits.dynamics import CraftState

COLUMNS = tuple(f"quaternion_{part}" for part in "cxyz")
"""Names of the columns read: scalar first, Hamilton; passive, body from EME2000 once read."""

CONJUGATE = np.array((1.0, -1.0, -1.0, -1.0))

CONVENTIONS = {"body_from_celestial": np.ones(4), "celestial_from_body": CONJUGATE}
"""Convention of a file's quaternions -> factors that make them passive ones of the body from EME2000."""


class AttitudeTableError(ValueError):
    """A table that holds no attitude; the message is for people."""


def rotation_vectors(quaternion: F64) -> F64:
    """(..., 3) [rad] of unit quaternions (..., 4) taken the short way."""
    short = np.where(quaternion[..., :1] < 0, -quaternion, quaternion)
    sine = np.linalg.norm(short[..., 1:], axis=-1)
    angle = 2 * np.arctan2(sine, short[..., 0])
    return short[..., 1:] * (angle / np.where(sine > 0, sine, 1.0))[..., None]


class TabulatedAttitude:
    """Attitude of a table (n rows); the craft's state has no part in it.

    measured  the Earth's orientation, the same that the craft's trajectory has
    convention   of the table, a row of CONVENTIONS
    """

    def __init__(
        self,
        table: Table,
        origin: str,
        measured: Orientation | None = None,
        convention: str = "body_from_celestial",
    ):
        norms = np.linalg.norm(table.columns, axis=1)
        odd = np.flatnonzero(np.abs(norms - 1) > 1e-3)
        if len(odd):
            raise AttitudeTableError(
                f"{origin}: row {odd[0] + 1}: quaternion has length {norms[odd[0]]:.4g}; an attitude has 1"
            )
        self._measured = measured
        self._t_ns = table.t_ns.tolist()
        self._quaternion = table.columns * CONVENTIONS[convention] / norms[:, None]
        # Passive: the step from one row's body axes to the next's stands on the right.
        back = self._quaternion[:-1] * CONJUGATE
        step = rotation_vectors(product(back, self._quaternion[1:]))
        self._rate_rps = step / (np.diff(table.t_ns) / gpstime.NS_PER_S)[:, None]

    def check(self, begin_ns: int, end_ns: int, origin: str) -> None:
        """AttitudeTableError unless the table holds all of a run."""
        if begin_ns < self._t_ns[0] or end_ns > self._t_ns[-1]:
            first, last, begin, end = map(gpstime.iso, (self._t_ns[0], self._t_ns[-1], begin_ns, end_ns))
            raise AttitudeTableError(
                f"{origin}: attitude from {first} to {last}; the run is from {begin} to {end} (GPS time)"
            )

    def doubt_rad(self, begin_ns: int, end_ns: int) -> tuple[float, float]:
        """About how far off the attitude may be at most between two rows that a run uses, by how much rates
        change from row to row [rad], and how far apart those rows are [s]."""
        step_s = np.diff(self._t_ns) / gpstime.NS_PER_S
        change = np.linalg.norm(np.diff(self._rate_rps, axis=0), axis=1) / ((step_s[:-1] + step_s[1:]) / 2)
        padded = np.concatenate(([0.0], change, [0.0]))
        doubt = np.maximum(padded[:-1], padded[1:]) * step_s**2 / 8
        first, last = np.searchsorted(self._t_ns, (begin_ns, end_ns), "right") - 1
        used = slice(max(first, 0), min(last, len(step_s) - 1) + 1)
        worst = int(np.argmax(doubt[used]))
        return float(doubt[used][worst]), float(step_s[used][worst])

    def body_from_eme2000(self, t_ns: int) -> F64:
        """The attitude at a GPS time (3, 3)."""
        row, turned, _ = self._turned(t_ns)
        return dcm_of_quaternion(product(self._quaternion[row], turned))

    def _turned(self, t_ns: int) -> tuple[int, F64, F64]:
        """The row before a GPS time, the turn since then (4,) and its rate, body axes (3,) [rad/s]."""
        row = min(max(bisect_right(self._t_ns, t_ns) - 1, 0), len(self._rate_rps) - 1)
        rate = self._rate_rps[row]
        half = 0.5e-9 * (t_ns - self._t_ns[row]) * rate
        angle = np.sqrt(half @ half)
        return row, np.append(np.cos(angle), half * np.sinc(angle / np.pi)), rate

    def at(self, t_ns: int, state: CraftState) -> tuple[F64, F64]:
        """Quaternion body from ECEF (4,) and rate relative to inertial space, body axes (3,) [rad/s]."""
        row, turned, rate = self._turned(t_ns)
        body_from_eme2000 = dcm_of_quaternion(product(self._quaternion[row], turned))
        ecef_from_eme2000 = frames.ecef_from_eme2000(t_ns, self._measured)
        return quaternion_of_dcm(body_from_eme2000 @ ecef_from_eme2000.T), rate

    def over(self, t_ns: I64, state: CraftState) -> tuple[F64, F64]:
        """The same (q, 4) and (q, 3) at times (q,)."""
        found = [self.at(t, state) for t in t_ns.tolist()]
        return np.stack([quaternion for quaternion, _ in found]), np.stack([rate for _, rate in found])
