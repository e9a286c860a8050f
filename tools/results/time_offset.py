"""Are fixes right, and of another time than their truth? A table in UTC read as GPS time is 114 km off, along
the orbit and nowhere else, and looks like a flight software that is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from gnss_hil.tools.results import truth as truths

LEAST_M = 50.0
"""Of median errors, what is worth a line; 7 ms of a low orbit."""

LEAST_RATIO = 10.0
"""Of errors, by what is left of them where the truth is moved along its own velocity."""


def remark(name: str, fixes: Mapping[str, np.ndarray], rows: np.ndarray) -> Iterator[str]:
    """A line if most of what a craft's fixes err by is one interval of time.

    fixes, rows   columns of fixes.parquet, rows of truth
    """
    fixes, rows = truths.at_fixes(fixes, rows)
    velocity_mps = rows["velocity_ecef_mps"]
    known = np.isfinite(velocity_mps).all(axis=1) & velocity_mps.any(axis=1)
    if not known.any():
        return
    error_m = np.column_stack([fixes[f"{a}_m"] for a in "xyz"]) - rows["position_ecef_m"]
    error_m, velocity_mps = error_m[known], velocity_mps[known]
    along_s = np.einsum("na,na->n", error_m, velocity_mps) / np.einsum("na,na->n", velocity_mps, velocity_mps)
    offset_s = float(np.median(along_s))
    before_m, after_m = (
        float(np.median(np.linalg.norm(e, axis=1))) for e in (error_m, error_m - offset_s * velocity_mps)
    )
    if before_m > LEAST_M and before_m > LEAST_RATIO * after_m:
        way = "earlier" if offset_s > 0 else "later"
        yield (
            f"craft {name}: fixes are {before_m:.0f} m from the truth on the median, and {after_m:.0f} m if "
            f"its times are taken {abs(offset_s):.3g} s {way}: are they of one time system?"
        )
