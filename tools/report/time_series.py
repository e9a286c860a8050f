"""Time series: how many satellites, how well they stand, how wrong the fix is, how strong signals are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.report import residuals
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.decimate import BUCKETS, extremes
from gnss_hil.tools.report.plot import (
    Json,
    Plot,
    antenna_colour,
    axis,
    band,
    layout,
    line,
    log_axis,
    milliseconds,
    moments,
    numbers,
    piled,
    positive_span,
    time_axis,
)

NO_TRUTH = "No truth was kept with this run, so nothing can be compared with it."
NO_CHANNELS = "This run kept no table of channels (it was played without a log)."
NO_MARK = "No time mark was heard."
NO_FIX = "There is not one valid fix in this run."


def trace(name: str, t_ns: I64, values: NDArray, colour: str, **more) -> Json:
    """A line of a time series, thinned so that peaks and gaps stay."""
    rows = extremes(np.asarray(values, float))
    return line(name, moments(t_ns[rows]), numbers(values[rows]), colour, **more)


def satellites(craft: Craft) -> Plot:
    if not len(craft.t_ns):
        return Plot.missing("Satellites", NO_MARK)
    used = craft.counts["satellites_used"]
    traces = [trace("in the fix", craft.t_ns, used, "--accent", line={"shape": "hv"})]
    note = "Distinct satellites in the fix" + ("" if craft.listed.any() else ", as NAV_STATUS counts them")
    if craft.visible is not None:
        traces.insert(0, trace("in view", craft.t_ns, craft.visible, "--muted", line={"shape": "hv"}))
        note += "; in view: healthy, clear of the Earth and strong enough at some antenna, as truth has it"
    y = axis("satellites", rangemode="tozero")
    return Plot("Satellites", f"{note}. Shaded: no fix.",
                {"data": traces,
                 "layout": layout(time_axis(craft.t_ns), y, shapes=shades(craft)[0])})  # fmt: skip


def satellites_by_antenna(craft: Craft) -> Plot:
    title = "Satellites by antenna"
    if craft.by_antenna is None:
        return Plot.missing(title, NO_CHANNELS)
    if not len(craft.t_ns):
        return Plot.missing(title, NO_MARK)
    shapes, shaded = shades(craft)
    rows = []
    for receiver, count in craft.by_antenna.items():
        name, channels = craft.vehicle.names[receiver - 1], int(craft.vehicle.channels[receiver - 1])
        line_ = trace(name, craft.t_ns, count, antenna_colour(receiver), line={"shape": "hv"})
        rows.append((axis(name, range=[-0.4, max(channels, count.max(initial=0)) + 0.4], nticks=4), [line_]))
    return Plot(
        title, f"Different satellites that each receiver measured; axes go up to its channels. {shaded}",
        piled(craft.t_ns, rows, showlegend=False, shapes=shapes), height=110 + 70 * len(rows), wide=True,
    )  # fmt: skip


def residuals_by_satellite(craft: Craft) -> Plot:
    if craft.residuals is None:
        return Plot.missing("Residuals", NO_CHANNELS)
    return residuals.picture(
        craft.t_ns, craft.residuals, craft.looked_at, shades(craft)[0], bool(craft.listed.any())
    )


def dilution(craft: Craft) -> Plot:
    pdop = np.r_[craft.counts["pdop"], craft.counts["pdop_distinct"]]
    if np.isnan(craft.counts["pdop"]).all():
        return Plot.missing("Dilution of precision", NO_FIX)
    published = trace("as published", craft.t_ns, craft.counts["pdop"], "--accent")
    once = trace("each satellite once", craft.t_ns, craft.counts["pdop_distinct"], "--muted",
                 line={"dash": "dot"})  # fmt: skip
    listed = craft.listed.any()
    computed = (
        "and as computed here with every satellite once"
        if listed
        else "fixes do not say which channels they are of, so nothing was computed here"
    )
    traces = [once, published] if listed else [published]
    return Plot(
        "Dilution of precision",
        f"Over all measurements of the fix, as published; {computed}.",
        {
            "data": traces,
            "layout": layout(
                time_axis(craft.t_ns), log_axis("PDOP", *positive_span(pdop)), shapes=shades(craft)[0]
            ),
        },
    )


_MOST_SHADES = 300
"""Shades that a browser draws with ease; those that are closer than a pixel become one."""


def shades(craft: Craft) -> tuple[list[Json], str]:
    """Epochs without a fix as shades over a time axis, and what they are, in words."""
    lacking = craft.without_fix
    if not len(lacking):
        return [], "Every epoch has a fix."
    half = craft.interval_ns // 2
    begin, end = lacking.begin_ns - half, lacking.begin_ns + lacking.epochs * craft.interval_ns - half
    nearest = int(craft.t_ns[-1] - craft.t_ns[0]) // BUCKETS if len(lacking) > _MOST_SHADES else 0
    apart = np.r_[True, begin[1:] - end[:-1] > nearest]
    begin, end = begin[apart], end[np.r_[apart[1:], True]]
    shapes = [{"type": "rect", "xref": "x", "yref": "paper", "x0": a, "x1": b, "y0": 0, "y1": 1,
               "layer": "below", "fillcolor": "--idle", "line": {"width": 0}}
              for a, b in zip(milliseconds(begin), milliseconds(end), strict=True)]  # fmt: skip
    many = so_many(int(lacking.epochs.sum()), "epoch")
    return shapes, f"Shaded: no fix, {many} in {_stretches(len(lacking))}."


def _stretches(count: int) -> str:
    return "one stretch" if count == 1 else f"{count} stretches"


def strength(craft: Craft) -> Plot:
    title = "Carrier to noise density"
    if craft.strength is None:
        return Plot.missing(title, NO_CHANNELS)
    if not craft.strength:
        return Plot.missing(title, NO_MARK)
    rows, names = [], craft.vehicle.names
    for receiver, s in craft.strength.items():
        colour, name = antenna_colour(receiver), names[receiver - 1]
        spread = band("", s.t_ns, s.least, s.greatest, colour, opacity=0.25)
        same = {"matches": "y"} if rows else {}
        rows.append((axis(name, nticks=4, **same),
                     [spread, line(name, moments(s.t_ns), numbers(s.mean), colour)]))  # fmt: skip
    return Plot(
        title, "By antenna [dBHz]: mean of its channels; the band is from the weakest to the strongest.",
        piled(craft.t_ns, rows, showlegend=False), height=110 + 75 * len(names), wide=True,
    )  # fmt: skip


def load(craft: Craft) -> Plot:
    if not len(craft.t_ns):
        return Plot.missing("Bus load", NO_MARK)
    percent = craft.counts["bits"] / (craft.interval_ns / 1e9 * BIT_RATE) * 100
    return Plot(
        "Bus load",
        f"Bits of all frames of an epoch, stuffing included, at {BIT_RATE / 1e6:g} Mbit/s.",
        {"data": [trace("load", craft.t_ns, percent, "--accent")],
         "layout": layout(time_axis(craft.t_ns), axis("load [%]", rangemode="tozero"), showlegend=False)},
    )  # fmt: skip


def faults(craft: Craft) -> Plot | None:
    """Frames that were refused; None if there were none."""
    refused = craft.counts["faults"]
    at = np.flatnonzero(refused > 0)
    if not len(at):
        return None
    rows = at[np.unique(extremes(refused[at]))]
    bars = {"type": "scatter", "mode": "markers", "name": "refused", "x": moments(craft.t_ns[rows]),
            "y": numbers(refused[rows]), "marker": {"color": "--bad", "size": 5}}  # fmt: skip
    return Plot(
        "Frames refused",
        "Frames that the checks of the protection refused, by epoch; the table above has the reasons.",
        {"data": [bars], "layout": layout(time_axis(craft.t_ns), axis("frames", rangemode="tozero"))},
    )  # fmt: skip


def latency(histogram: list, p50: float | None, p99: float | None) -> Plot:
    title = "Latency of an epoch"
    if not histogram:
        return Plot.missing(title, "This run did not keep the distribution of its latencies.")
    edges = np.array([edge for edge, _ in histogram], float)
    counts = np.array([count for _, count in histogram], float)
    low = edges / 1.01**10
    bars = {"type": "bar", "x": np.sqrt(edges * low).tolist(), "y": counts.tolist(), "name": "epochs",
            "width": (edges - low).tolist(), "marker": {"color": "--accent", "line": {"width": 0}},
            "hovertemplate": "%{y} epochs at %{x:.3g} ms<extra></extra>"}  # fmt: skip
    marks = [(p, name) for p, name in ((p50, "p50"), (p99, "p99")) if p]
    lines = [{"type": "line", "x0": p, "x1": p, "y0": 0, "y1": 1, "yref": "paper",
              "line": {"color": "--ink", "width": 1, "dash": "dot"}} for p, _ in marks]  # fmt: skip
    words = [{"x": float(np.log10(p)), "y": 1, "yref": "paper", "text": f"{name} {p:.3g} ms",
              "yanchor": "bottom", "yshift": 13 * k, "showarrow": False, "font": {"size": 11}}
             for k, (p, name) in enumerate(marks)]  # fmt: skip
    return Plot(
        title, "From the last measurement's way out to the fix's way in; how often.",
        {"data": [bars], "layout": layout(log_axis("latency [ms]", low[0], edges[-1]), axis("epochs"),
                                          shapes=lines, annotations=words, showlegend=False)},
    )  # fmt: skip
