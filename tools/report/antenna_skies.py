"""The sky of each antenna: which antenna tracks what is there."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import Index
from gnss_hil.dbc.common.gpstime import iso
from gnss_hil.dbc.common.satellites import name as satellite_name
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.markup import Markup, tag
from gnss_hil.tools.report.plot import Json, Plot, antenna_colour, numbers
from gnss_hil.tools.report.sky_plot import Sightings, side_names
from gnss_hil.tools.report.time_series import NO_CHANNELS

NO_SKY = "No instant has both an attitude on the bus and a place of the craft."
_IDLE, _ANOTHER, _THIS = range(3)
_COLOURS = ("--idle", "--other", "")
_SIZES = (3, 3, 4)


def legend() -> Markup:
    """What the colours and lines of the skies are."""
    idle, another, own = (
        tag.span("\u25cf", style=f"color:var({c})") for c in ("--idle", "--other", "--antenna-1")
    )
    return tag.p(
        idle, " tracked by none \u2002 ", another, " by another antenna \u2002 ",
        own, " by this antenna, in its colour; named where it was at the end \u2002 \u2508 mask. "
        "Rings: angle off the boresight, every 30°; round it the body's sides. Satellites behind the Earth "
        "are left out.",
        class_="note",
    )  # fmt: skip


def skies(craft: Craft) -> list[Plot]:
    """A sky for each antenna."""
    if craft.sightings is None:
        return [Plot.missing("Sky of the antennas", NO_CHANNELS)]
    if not len(craft.sightings.t_ns):
        return [Plot.missing("Sky of the antennas", NO_SKY)]
    return [_sky(craft, craft.sightings, antenna) for antenna in range(craft.vehicle.antennas)]


def _sky(craft: Craft, seen: Sightings, antenna: int) -> Plot:
    vehicle = craft.vehicle
    mask_deg = float(np.degrees(vehicle.mask_rad[antenna]))
    reach_deg = max(90.0, mask_deg)
    here = seen.tracked[:, antenna]
    kind = np.where(here, _THIS, np.where(seen.tracked.any(axis=1), _ANOTHER, _IDLE))
    inside = seen.off_deg[:, antenna] <= reach_deg
    data = [_points(seen, antenna, np.flatnonzero(inside & (kind == k)), k) for k in range(3)]
    data.append(_mask(mask_deg))
    data.append(_named(seen, antenna, np.flatnonzero(inside & here & (seen.instant == seen.instant.max()))))
    sides = list(side_names(vehicle.boresight_body[antenna]))
    polar = {
        "radialaxis": {"range": [0, reach_deg], "dtick": 30, "showticklabels": False, "ticks": ""},
        "angularaxis": {"rotation": 90, "direction": "clockwise", "tickvals": [0, 90, 180, 270],
                        "ticktext": sides},
    }  # fmt: skip
    margin = {"l": 60, "r": 60, "t": 30, "b": 30}
    figure = {"data": data, "layout": {"polar": polar, "showlegend": False, "margin": margin}}
    return Plot(f"Sky of antenna {vehicle.names[antenna]}", "", figure, height=350)


def _points(seen: Sightings, antenna: int, rows: Index, kind: int) -> Json:
    colour = _COLOURS[kind] or antenna_colour(antenna + 1)
    words = [f"{satellite_name(s)} {iso(int(t))[11:19]}"
             for s, t in zip(seen.satellite[rows], seen.t_ns[rows], strict=True)]  # fmt: skip
    return _polar(
        seen, antenna, rows, mode="markers", text=words,
        hovertemplate="%{text}, %{r:.0f}° off<extra></extra>",
        marker={"size": _SIZES[kind], "color": colour},
    )  # fmt: skip


def _named(seen: Sightings, antenna: int, rows: Index) -> Json:
    """What the antenna tracked at the end, by name."""
    edge = {"color": "--paper", "width": 1}
    return _polar(
        seen, antenna, rows, mode="markers+text", hoverinfo="skip", textposition="top center",
        text=[satellite_name(s) for s in seen.satellite[rows]],
        textfont={"size": 10, "color": "--ink"},
        marker={"size": 8, "color": antenna_colour(antenna + 1), "line": edge},
    )  # fmt: skip


def _polar(seen: Sightings, antenna: int, rows: Index, **more) -> Json:
    off, around = numbers(seen.off_deg[rows, antenna]), numbers(seen.round_deg[rows, antenna])
    return {"type": "scatterpolar", "r": off, "theta": around} | more


def _mask(mask_deg: float) -> Json:
    theta = np.linspace(0, 360, 121)
    return {"type": "scatterpolar", "mode": "lines", "r": numbers(np.full(121, mask_deg)),
            "theta": numbers(theta), "hoverinfo": "skip",
            "line": {"color": "--soft", "width": 1, "dash": "dot"}}  # fmt: skip
