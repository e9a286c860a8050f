"""Plots of how wrong the fixes are: position, velocity, and both by the flight software's own covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.decimate import bucket_starts, extremes
from gnss_hil.tools.report.errors import Errors
from gnss_hil.tools.report.plot import (
    Json,
    Plot,
    axis,
    band,
    layout,
    line,
    log_axis,
    moments,
    numbers,
    piled,
    time_axis,
)
from gnss_hil.tools.report.time_series import NO_FIX, NO_TRUTH, shades, trace
from gnss_hil.tools.results.figures import small

_DIRECTIONS = ("radial", "along", "cross")
_BANDS = ((3, "--band-3"), (1, "--band-1"))


def position_error(craft: Craft) -> Plot:
    return _error(
        craft,
        craft.position,
        "Position error",
        "m",
        "Fix minus truth at the centre of mass; radial is up, along with the motion, cross on the orbit's "
        "normal.",
    )


def velocity_error(craft: Craft) -> Plot:
    return _error(
        craft,
        craft.velocity,
        "Velocity error",
        "m/s",
        "Fix minus truth, relative to the Earth; axes as above.",
    )


def _error(craft: Craft, errors: Errors | None, title: str, unit: str, what: str) -> Plot:
    if errors is None:
        return Plot.missing(title, NO_TRUTH)
    if np.isnan(errors.value).all():
        return Plot.missing(title, NO_FIX)
    most = np.nanmax(np.abs(errors.value), axis=0)
    worst = ", ".join(f"{d} {small(v)}" for d, v in zip(_DIRECTIONS, most, strict=True))
    shapes, shaded = shades(craft)
    rows = []
    for i, direction in enumerate(_DIRECTIONS):
        error, sigma = errors.value[:, i], errors.sigma[:, i]
        limit = view(error, sigma)
        traces = [*sigma_bands(craft.t_ns, sigma), trace("fix - truth", craft.t_ns, error, "--accent",
                                                         line={"width": 1})]  # fmt: skip
        rows.append((axis(f"{direction} [{unit}]", range=[-limit, limit]), traces))
    bands = (
        " No sigma was published with it."
        if np.isnan(errors.sigma).all()
        else " Bands: 1 and 3 sigma of the flight software's own covariance."
    )
    return Plot(
        title,
        f"{what}{bands} The first view may leave out the worst, at most {worst} {unit}; double-click shows "
        f"all. {shaded}",
        piled(craft.t_ns, rows, shapes=shapes),
        height=480, wide=True,
    )  # fmt: skip


def sigma_bands(t_ns: NDArray, sigma: F64) -> list[Json]:
    """One and three standard deviations (e,) about zero; the band closes at the ends of a gap."""
    rows = extremes(sigma)
    rows = rows[~np.isnan(sigma[rows])]
    return [band(f"{factor} sigma", t_ns[rows], -factor * sigma[rows], factor * sigma[rows], colour)
            for factor, colour in _BANDS if len(rows)]  # fmt: skip


def view(error: F64, sigma: F64) -> float:
    """Half height of the first view: nine errors of ten, and the usual 3 sigma."""
    wanted = [1e-4]
    if not np.isnan(error).all():
        wanted.append(1.3 * np.nanpercentile(np.abs(error), 90))
    if not np.isnan(sigma).all():
        wanted.append(3.6 * np.nanmedian(sigma))
    return float(max(wanted))


CHI2_95 = 0.2158, 9.348
CHI2_MEDIAN = 2.366
"""Quantiles 0.025, 0.975 and 0.5 of chi-square with three degrees of freedom. Source: NIST/SEMATECH
e-Handbook, 1.3.6.7.4"""
_MEANS = 60
"""Stretches of which the mean is drawn."""
_LEAST = 1e-3
"""Squared errors below are drawn here: a thousandth is no error at all."""


def consistency(craft: Craft) -> Plot:
    """Normalised squared errors of position and velocity over time."""
    title = "Normalised squared error"
    if craft.position is None or craft.velocity is None:
        return Plot.missing(title, NO_TRUTH)
    if np.isnan(craft.position.value).all():
        return Plot.missing(title, NO_FIX)
    low, high = CHI2_95
    data, words, tops = [], [], [high]
    for name, errors, colour in (
        ("position", craft.position, "--accent"),
        ("velocity", craft.velocity, "--second"),
    ):
        nees = errors.nees
        known = nees[~np.isnan(nees)]
        if not len(known):
            words.append(f"{name} has no covariance")
            continue
        shown = np.maximum(nees, _LEAST)
        data += [
            trace(name, craft.t_ns, shown, colour, opacity=0.3, line={"width": 1}, showlegend=False,
                  hoverinfo="skip"),
            _means(f"{name}, mean", craft.t_ns, nees, colour),
        ]  # fmt: skip
        inside = 100 * float(((low <= known) & (known <= high)).mean())
        words.append(f"{name} {small(float(np.median(known)))}, {inside:.0f} % of fixes in the band")
        tops.append(float(np.percentile(known, 99.5)))
    if not data:
        return Plot.missing(
            title, f"No fix has a covariance that truth could be held against: {'; '.join(words)}."
        )
    y = log_axis("e' P\u207b\u00b9 e", low / 3, max(tops))
    shapes = [
        {"type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y0": low, "y1": high, "layer": "below",
         "fillcolor": "--band-3", "line": {"width": 0}},
        {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": 3, "y1": 3,
         "line": {"color": "--ink", "width": 1, "dash": "dash"}},
    ]  # fmt: skip
    return Plot(
        title,
        "Error by the covariance published with the fix (NEES). A true covariance makes 3 on the mean "
        f"(dashed) and leaves 95 % in the band, {low:.2f} to {high:.2f}; above it promises too much, below "
        f"too little. Medians, where {CHI2_MEDIAN:.2f} is right: {'; '.join(words)}.",
        {"data": data, "layout": layout(time_axis(craft.t_ns), y, shapes=shapes)},
        height=340,
        wide=True,
    )


def _means(name: str, t_ns: NDArray, values: F64, colour: str) -> Json:
    """Means of stretches of time (each at its middle); nan where none is there."""
    starts = bucket_starts(len(values), _MEANS)
    ends = np.r_[starts[1:], len(values)]
    count = np.add.reduceat(~np.isnan(values), starts, dtype=np.int64)
    total = np.add.reduceat(np.nan_to_num(values), starts)
    mean = np.divide(total, count, out=np.full(len(starts), np.nan), where=count > 0)
    middle = (t_ns[starts] + t_ns[ends - 1]) // 2
    return line(name, moments(middle), numbers(np.maximum(mean, _LEAST)), colour, line={"width": 2})
