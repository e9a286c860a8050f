"""Names beside points of a picture, so that none covers another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64

_AWAY_PX = (10.0, 14.0, 19.0, 25.0, 32.0, 40.0)
_ROUND_DEG = np.arange(0, 360, 30)
_STEPS_PX = np.array(
    [(1.5 * away * np.sin(a), away * np.cos(a)) for away in _AWAY_PX for a in np.radians(_ROUND_DEG)]
)
"""A label is wider than high, and needs more room beside a point than above."""
_CELL_PX = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Ink:
    """How many drawn points lie in any box of a square picture about the origin, by sums over cells."""

    half: int
    sums: F64

    @classmethod
    def of(cls, drawn_px: F64, half_px: float) -> Ink:
        """drawn_px (k, 2) within half_px of the origin on both axes."""
        half = int(np.ceil(half_px / _CELL_PX)) + 1
        cell = np.clip(np.floor(drawn_px / _CELL_PX).astype(np.int64) + half, 0, 2 * half - 1)
        count = np.zeros((2 * half + 1, 2 * half + 1))
        np.add.at(count, (cell[:, 0] + 1, cell[:, 1] + 1), 1)
        return cls(half, np.minimum(count, 1).cumsum(axis=0).cumsum(axis=1))

    def within(self, centres: F64, size: F64) -> F64:
        """(c,) inked cells of boxes of a size (2,) about centres (c, 2)."""
        low, high = (np.clip(np.round((centres + s * size / 2) / _CELL_PX).astype(np.int64) + self.half, 0,
                             2 * self.half) for s in (-1, 1))  # fmt: skip
        (x0, y0), (x1, y1) = low.T, high.T
        return self.sums[x1, y1] - self.sums[x0, y1] - self.sums[x1, y0] + self.sums[x0, y0]


def beside(points_px: F64, size_px: tuple[float, float], there_px: F64, ink: Ink, radius_px: float) -> F64:
    """(n, 2) centres of labels of one size (width, height) for points (n, 2), in pixels.

    Each stands where it covers least, and there as near to its point as it can: labels before it and those
    that are there already, about (k, 2), count most, then points, then what is drawn. No centre is further
    than the radius from the origin, where a point is not.
    """
    box = np.array(size_px)
    near = np.repeat(np.arange(len(_AWAY_PX)), len(_ROUND_DEG))
    placed = np.array(there_px, float)
    for point in points_px:
        centres = point + _STEPS_PX
        worst = 100 * _covered(centres, placed, box) + 20 * _covered(centres, points_px, box / 2 + 3)
        outside = np.maximum(np.linalg.norm(centres, axis=1) - radius_px, 0)
        cost = worst + ink.within(centres, box) + near + 1e4 * outside
        placed = np.r_[placed, centres[[np.argmin(cost)]]]
    return placed[len(there_px) :]


def _covered(centres: F64, others: F64, reach: F64) -> F64:
    """(c,) others (n, 2) that lie within reach of boxes at centres (c, 2), and how far, up to 2 each."""
    apart = np.abs(centres[:, None] - others[None])
    inside = (1 - apart / reach).min(axis=-1)
    return np.where(inside > 0, 1 + inside, 0).sum(axis=1)
