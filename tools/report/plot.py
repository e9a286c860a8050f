"""Plots as plain plotly documents: no plotly in Python, no colours but by name.

Colours are names of the page's custom properties ("--antenna-1", "--muted"); the page puts in what they are
in light, in dark and on paper.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.gpstime import NS_PER_S, UNIX_OF_GPS_EPOCH_S
from gnss_hil.tools.report.decimate import extremes

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Plot:
    """One plot of a page.

    figure   traces and layout; None if there is nothing to draw
    note     how to read it; of a plot without figure, why there is none
    wide     takes the whole width
    """

    title: str
    note: str
    figure: Json | None
    height: int = 300
    wide: bool = False

    @classmethod
    def missing(cls, title: str, why: str) -> Plot:
        return cls(title, why, None)


def antenna_colour(receiver: int) -> str:
    """The one colour of a receiver's antenna, 1-based, throughout a page."""
    return f"--antenna-{receiver}"


def numbers(values: NDArray) -> Json:
    """Values as plotly's typed array, single precision: seven digits are more than a picture shows."""
    return _typed(values, "f4")


def array2d(values: NDArray) -> Json:
    """Values (r, c) as plotly's typed array of rows."""
    return _typed(values, "f4") | {"shape": f"{values.shape[0]}, {values.shape[1]}"}


def usual_span(values: NDArray) -> list[float]:
    """A first view of all but the wildest hundredth of values, with some air."""
    low, high = np.nanpercentile(values, (0.5, 99.5))
    air = 0.15 * (high - low) or 1e-3
    return [float(low - air), float(high + air)]


def moments(t_ns: I64) -> Json:
    """GPS time as milliseconds of a calendar that runs with it, for an axis of dates."""
    return _typed(np.asarray(t_ns) / 1e6 + UNIX_OF_GPS_EPOCH_S * 1e3, "f8")


def milliseconds(t_ns: I64) -> list[int]:
    """The same for attributes that take no typed arrays."""
    return (np.asarray(t_ns) // (NS_PER_S // 1000) + UNIX_OF_GPS_EPOCH_S * 1000).tolist()


def _typed(values: NDArray, kind: str) -> Json:
    return {
        "dtype": kind,
        "bdata": base64.b64encode(np.asarray(values).astype(f"<{kind}").tobytes()).decode(),
    }


def line(name: str, x: Json, y: Json, colour: str, **more) -> Json:
    """A line of single points; gaps stay gaps."""
    style = {"color": colour, "width": 1.5} | more.pop("line", {})
    return {"type": "scatter", "mode": "lines", "name": name, "x": x, "y": y, "line": style} | more


def band(name: str, t_ns: I64, low: F64, high: F64, colour: str, **more) -> Json:
    """The area between two lines over time."""
    x, y = np.r_[t_ns, t_ns[::-1]], np.r_[high, low[::-1]]
    return {"type": "scatter", "mode": "lines", "name": name, "x": moments(x), "y": numbers(y),
            "fill": "toself", "fillcolor": colour, "hoverinfo": "skip",
            "line": {"width": 0, "color": colour}} | more  # fmt: skip


def overlaid(title: str, note: str, x: Json, y: Json, curves: Iterable[tuple[str, F64, F64]]) -> Plot:
    """Curves (name, x, y) over one pair of axes, in the antennas' colours by their order, thinned."""
    traces = []
    for k, (name, along, values) in enumerate(curves, 1):
        at = extremes(values)
        colour = antenna_colour(k)
        traces.append(line(name, numbers(along[at]), numbers(values[at]), colour, line={"width": 1}))
    return Plot(title, note, {"data": traces, "layout": layout(x, y)})


def layout(x: Json, y: Json, **more) -> Json:
    """A layout of one pair of axes."""
    return {"xaxis": x, "yaxis": y} | more


def axis(title: str, **more) -> Json:
    return {"title": {"text": title}} | more


_SETS = (
    (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0),
    (1.0, 1.5, 2.0, 3.0, 5.0, 7.0),
    (1.0, 2.0, 5.0),
    (1.0,),
)
"""Where a decade has ticks, from the finest on."""
_MOST_TICKS = 8


def log_ticks(low: float, high: float) -> list[float]:
    """Ticks of a logarithmic axis, from the last at or below `low` > 0 to the first at or above `high`: the
    finest set that makes at most eight; of very many decades every second, third, ..."""
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    found: list[float] = []
    for marks in _SETS:
        every = [float(f"{m * 10.0**k:.6g}") for k in decades for m in marks]
        begin = max((i for i, v in enumerate(every) if v <= low), default=0)
        end = min((i for i, v in enumerate(every) if v >= high), default=len(every) - 1)
        found = every[begin : max(end, begin + 1) + 1]
        if len(found) <= _MOST_TICKS:
            break
    return found[:: -(-len(found) // _MOST_TICKS)]


def log_axis(title: str, low: float, high: float) -> Json:
    """A logarithmic axis whose first view is from `low` to `high`, both positive, a labelled tick below and
    one above; plotly's own labels of such axes leave out the decade ("2", "5")."""
    ticks = log_ticks(low, high)
    limits = [float(np.log10(min(low, ticks[0]))), float(np.log10(max(high, ticks[-1])))]
    return axis(title, type="log", tickvals=ticks, ticktext=[f"{v:.10g}" for v in ticks], range=limits)


def positive_span(*values: NDArray) -> tuple[float, float]:
    """Least and greatest of what is positive and finite; 1 to 10 where nothing is."""
    every = np.concatenate([np.asarray(v, float).ravel() for v in values]) if values else np.zeros(0)
    every = every[np.isfinite(every) & (every > 0)]
    return (float(every.min()), float(every.max())) if len(every) else (1.0, 10.0)


def piled(t_ns: I64, rows: Sequence[tuple[Json, list[Json]]], **more) -> Json:
    """A figure of several plots over one time axis: rows of a y axis and its traces, the first on top. Names
    stand in the legend once."""
    data, axes, named = [], {}, set()
    for i, ((y, traces), domain) in enumerate(zip(rows, stacked(len(rows)), strict=True)):
        axes[numbered("yaxis", i)] = y | {"domain": domain}
        for one in traces:
            data.append({"showlegend": one["name"] not in named} | one | {"yaxis": numbered("y", i)})
            named.add(one["name"])
    x = time_axis(t_ns, anchor=numbered("y", len(rows) - 1))
    return {"data": data, "layout": axes | {"xaxis": x} | more}


def time_axis(t_ns: I64, **more) -> Json:
    """GPS time of time marks (e,), all of it; plots of one craft move together along it (see page.js)."""
    limits = {"range": milliseconds(t_ns[[0, -1]])} if len(t_ns) > 1 else {}
    return axis("GPS time", type="date", **limits, **more)


def stacked(rows: int, gap: float = 0.04) -> list[list[float]]:
    """Vertical domains of so many plots over one time axis, the first on top."""
    height = (1 - gap * (rows - 1)) / rows
    return [[round(max(0, 1 - (i + 1) * height - i * gap), 4), round(1 - i * (height + gap), 4)]
            for i in range(rows)]  # fmt: skip


def numbered(name: str, i: int) -> str:
    """plotly's name of the i-th axis, 0-based: yaxis, yaxis2, ..."""
    return name if i == 0 else f"{name}{i + 1}"
