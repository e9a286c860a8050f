"""The assignment in time: a row for each satellite, a colour for each antenna."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.common.satellites import name as satellite_name
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.plot import Json, Plot, antenna_colour, axis, milliseconds, time_axis
from gnss_hil.tools.report.time_series import NO_CHANNELS
from gnss_hil.tools.report.tracking_arcs import Lanes, lanes

_ROW = 0.84
"""Height of a bar in rows; the rest is air."""


def assignment(craft: Craft) -> Plot:
    title = "Assignment"
    if craft.holds is None:
        return Plot.missing(title, NO_CHANNELS)
    if not len(craft.holds):
        return Plot.missing(title, "No receiver measured a satellite.")
    cut = lanes(craft.holds)
    rows = np.unique(cut.holds.satellite)[::-1]  # GPS on top
    doubled = len(np.unique(cut.holds.satellite[cut.share > 1]))
    marks = _taken_up(craft)
    note = (
        f"Which antenna measured which satellite, and when: {so_many(len(rows), 'satellite')}. "
        f"Diamonds are handovers, satellites that commands took from one antenna and gave to another, "
        f"where that one first measured them: {len(marks)} of {len(craft.handed)}. "
    )
    note += (
        f"Where a row is split, several antennas held the satellite at once: {so_many(doubled, 'satellite')}."
        if doubled
        else "No satellite was held by two antennas at once."
    )
    note += "".join(f" {words}" for words in _empty(craft))
    if craft.bridge_ns:
        note += f" Breaks of up to {craft.bridge_ns / 1e9:g} s are not drawn."
    data = [_bars(craft, cut, rows, receiver) for receiver in range(1, craft.vehicle.antennas + 1)]
    data += _handovers(craft, marks, rows)
    names = [satellite_name(s) for s in rows]
    y = axis("satellite", tickvals=list(range(len(rows))), ticktext=names, range=[-0.7, len(rows) - 0.3],
             zeroline=False, showgrid=False, tickfont={"size": 10})  # fmt: skip
    figure = {
        "data": data,
        "layout": {"xaxis": time_axis(craft.t_ns), "yaxis": y, "barmode": "overlay", "bargap": 0},
    }
    return Plot(title, note, figure, height=150 + 15 * len(rows), wide=True)


_SAME_AXIS_DEG = 0.01


def _empty(craft: Craft) -> list[str]:
    """Of each antenna that measured nothing: that it did, and why where its axis tells."""
    assert craft.holds is not None
    used, names, axes = set(craft.holds.receiver.tolist()), craft.vehicle.names, craft.vehicle.boresight_body
    told = []
    for a, name in enumerate(names):
        if a + 1 in used:
            continue
        twins = [b for b in range(a) if _angle_deg(axes[a], axes[b]) < _SAME_AXIS_DEG]
        why = (
            f": it looks where {names[twins[0]]} does, and at a tie the lower antenna is given the satellite"
            if twins and craft.handed_out
            else ""
        )
        told.append(f"Antenna {name} measured nothing{why}.")
    return told


def _angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def _bars(craft: Craft, cut: Lanes, rows: np.ndarray, receiver: int) -> Json:
    mine = np.flatnonzero(cut.holds.receiver == receiver)
    held, share, lane = cut.holds[mine], cut.share[mine], cut.lane[mine]
    width = _ROW / share
    begin, end = milliseconds(held.begin_ns), milliseconds(held.end_ns)
    return {
        "type": "bar", "orientation": "h", "name": craft.vehicle.names[receiver - 1],
        "base": begin, "x": [b - a for a, b in zip(begin, end, strict=True)],
        "y": _row_of(rows, held.satellite).tolist(),
        "width": width.round(4).tolist(), "offset": (_ROW / 2 - (lane + 1) * width).round(4).tolist(),
        "marker": {"color": antenna_colour(receiver), "line": {"width": 0}},
        "customdata": [satellite_name(s) for s in held.satellite],
        "hovertemplate": "%{customdata} on %{fullData.name}, "
                         "%{base|%H:%M:%S} to %{x|%H:%M:%S}<extra></extra>",
    }  # fmt: skip


_TAKEN_UP_NS = 120_000_000_000
"""A satellite that was handed over is measured within this time, or was not taken up."""


def _taken_up(craft: Craft) -> list[tuple[int, int, int, int]]:
    """Handovers that led to a measurement, each at the first one."""
    assert craft.holds is not None
    held, found = craft.holds, []
    for t_ns, satellite, before, after in craft.handed:
        mine = (held.satellite == satellite) & (held.receiver == after)
        mine &= (held.end_ns > t_ns) & (held.begin_ns <= t_ns + _TAKEN_UP_NS)
        if mine.any():
            begin_ns = int(held.begin_ns[mine].min())
            found.append((max(t_ns, begin_ns), satellite, before, after))
    return found


def _handovers(craft: Craft, marks: list[tuple[int, int, int, int]], rows: np.ndarray) -> list[Json]:
    if not marks:
        return []
    names = craft.vehicle.names
    t_ns = np.array([t for t, *_ in marks], np.int64)
    return [{
        "type": "scatter", "mode": "markers", "name": "handover",
        "x": milliseconds(t_ns), "y": _row_of(rows, np.array([s for _, s, *_ in marks])).tolist(),
        "text": [f"{satellite_name(s)}: {names[a - 1]} to {names[b - 1]}" for _, s, a, b in marks],
        "hovertemplate": "%{text}, measured from %{x|%H:%M:%S}<extra></extra>",
        "marker": {"symbol": "diamond", "size": 7, "color": "--paper",
                   "line": {"color": "--ink", "width": 1.2}},
    }]  # fmt: skip


def _row_of(rows: np.ndarray, satellite: np.ndarray) -> np.ndarray:
    """Row of each satellite in the chart; rows are in falling order."""
    return len(rows) - 1 - np.searchsorted(rows[::-1], satellite)
