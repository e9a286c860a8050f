"""What was commanded, what was refused, and what was lost on the bus, over time."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.decimate import evenly
from gnss_hil.tools.report.plot import Json, Plot, axis, layout, moments, time_axis
from gnss_hil.tools.report.time_series import shades

_KINDS = (
    ("track", "triangle-up", "--accent", lambda e: (e["event"] == "command") & (e["action"] == "TRACK")),
    ("release", "triangle-down", "--second", lambda e: (e["event"] == "command") & (e["action"] != "TRACK")),
    ("repeat", "circle-open", "--soft", lambda e: e["event"] == "repeat"),
    ("refused", "x", "--bad", lambda e: (e["event"] == "ack") & (e["result"] != "ACCEPTED")),
)
"""Name, symbol, colour, and which rows of the command log."""

_MOST = 1500
"""Marks of one kind."""


def events(craft: Craft) -> Plot:
    """Commands by antenna, answers that refuse one, and epochs in which frames were refused."""
    title, log, names = "Commands and faults", craft.commands, craft.vehicle.names
    faults = np.flatnonzero(craft.counts["faults"] > 0)
    lanes = [*names, "frames"] if len(faults) else [*names]
    data, left_out = [], 0
    for name, symbol, colour, wanted in _KINDS:
        rows = np.flatnonzero(wanted(log) & (log["receiver"] >= 1) & (log["receiver"] <= len(names)))
        kept = rows[evenly(len(rows), _MOST)]
        left_out += len(rows) - len(kept)
        told = zip(*(log[k][kept].tolist() for k in ("satellite", "channel", "result")), strict=True)
        words = [" ".join(f"{name} {satellite} channel {channel} {result}".split())
                 for satellite, channel, result in told]  # fmt: skip
        lane = log["receiver"][kept].astype(np.int64) - 1
        data.append(_marks(f"{name}: {len(rows)}", log["t_ns"][kept], lane, symbol, colour, words))
    kept = faults[evenly(len(faults), _MOST)]
    left_out += len(faults) - len(kept)
    words = [f"{so_many(round(count), 'frame')} refused" for count in craft.counts["faults"][kept].tolist()]
    data.append(_marks(f"epochs with refused frames: {len(faults)}", craft.t_ns[kept],
                       np.full(len(kept), len(names)), "diamond", "--bad", words))  # fmt: skip
    data = [one for one in data if one["text"]]
    if not data:
        return Plot.missing(title, "Nothing was commanded, and no frame was refused.")
    shapes, shaded = shades(craft)
    note = f"Commands to the channels of each antenna, answers that refuse one, and frames refused. {shaded}"
    if left_out:
        note += f" {left_out} marks are not drawn."
    y = axis("", tickvals=list(range(len(lanes))), ticktext=lanes, range=[len(lanes) - 0.4, -0.6],
             zeroline=False)  # fmt: skip
    figure = {"data": data, "layout": layout(time_axis(craft.t_ns), y, shapes=shapes, showlegend=True)}
    return Plot(title, note, figure, height=130 + 26 * len(lanes), wide=True)


def _marks(name: str, t_ns: np.ndarray, lane: np.ndarray, symbol: str, colour: str, words: list[str]) -> Json:
    return {
        "type": "scatter", "mode": "markers", "name": name, "x": moments(t_ns), "y": lane.tolist(),
        "text": words, "hovertemplate": "%{text}, %{x|%H:%M:%S}<extra></extra>",
        "marker": {"symbol": symbol, "size": 7, "color": colour},
    }  # fmt: skip
