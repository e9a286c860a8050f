"""Where one craft is from another, by their fixes, and how wrong that is."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.error_plots import view
from gnss_hil.tools.report.plot import Json, Plot, axis, piled, usual_span
from gnss_hil.tools.report.time_series import trace
from gnss_hil.tools.results.figures import small

_DIRECTIONS = ("radial", "along", "cross")


def relative_position(first: Craft, second: Craft) -> Plot:
    """The second craft from the first, at the marks that both have, in the axes of the first one's orbit."""
    title = f"{second.name} from {first.name}"
    t_ns, a, b = np.intersect1d(first.t_ns, second.t_ns, return_indices=True)
    away = second.position_m[b] - first.position_m[a]
    if np.isnan(away).all():
        return Plot.missing(title, "No epoch has a fix of both.")
    axes = first.axes[a]
    parts = np.einsum("nij,nj->ni", axes, away)
    if np.isnan(parts).all():
        return Plot.missing(
            title, f"No fix of {first.name} has a velocity, so its orbit's axes are not known."
        )
    rows: list[tuple[Json, list[Json]]] = [
        (
            axis(f"{name} [m]", range=usual_span(parts[:, i])),
            [trace("by the fixes", t_ns, parts[:, i], "--accent")],
        )
        for i, name in enumerate(_DIRECTIONS)
    ]
    distance = np.linalg.norm(away, axis=1)
    words = (
        f"Difference of the fixes, in the axes of {first.name}'s orbit: radial is up, along with the motion. "
        f"{small(float(np.nanmin(distance)))} to {small(float(np.nanmax(distance)))} m apart. "
        "The first view leaves out the wildest hundredth."
    )
    if first.truth_m is not None and second.truth_m is not None:
        error = np.linalg.norm(away - (second.truth_m[b] - first.truth_m[a]), axis=1)
        rows.append((axis("error, 3-D [m]", range=[0, view(error, error * np.nan)]),
                     [trace("error", t_ns, error, "--second", line={"width": 1})]))  # fmt: skip
        words += f" Error against truth: {_figures(error)}; what both craft err alike cancels."
    return Plot(title, words, piled(t_ns, rows, showlegend=False), height=480, wide=True)


def _figures(error: F64) -> str:
    known = error[~np.isnan(error)]
    if not len(known):
        return "none, as truth has no such epoch"
    return f"{small(float(np.median(known)))} m median, {small(float(known.max()))} m at most"
