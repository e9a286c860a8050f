"""The sky of each antenna: which antenna tracks what is there, and where it goes."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Index
from gnss_hil.dbc.common.gpstime import iso
from gnss_hil.dbc.common.satellites import name as satellite_name
from gnss_hil.tools.report import labels
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.markup import Markup, tag
from gnss_hil.tools.report.plot import Json, Plot, antenna_colour, numbers
from gnss_hil.tools.report.sky_plot import Sightings, side_names
from gnss_hil.tools.report.time_series import NO_CHANNELS

NO_SKY = "No instant has both an attitude on the bus and a place of the craft."
_IDLE, _ANOTHER, _THIS = range(3)
_COLOURS = ("--other", "--other", "")
_WIDTHS = (1.0, 1.5, 3.0)
_DASHES = ("dot", "solid", "solid")
_RINGS_DEG = (30, 60, 90)
_RING_NAMES_AT_DEG = 45.0
_STEP_DEG = 15.0
"""Places of a satellite that are further apart are not joined: the run is too long for its lines."""
_NAMED_NS = 1_800_000_000_000
"""Satellites are named that were there in the last half hour."""
RADIUS_PX = 112.0
"""Of a sky in a window of 400 pixels; in a wider one everything is further apart."""
LABEL_PX = 25.0, 12.0
"""A name of three characters at ten pixels."""
_SIDE_PX = 5.0
"""Between the circle and the names of the sides."""


def legend() -> Markup:
    """What the colours and lines of the skies are."""
    own = tag.span("\u2501", style="color:var(--antenna-1)")
    idle, another = (tag.span(sign, style="color:var(--other)") for sign in ("\u2508", "\u2500"))
    return tag.p(
        own, " tracked by this antenna, in its colour \u2002 ", another, " by another \u2002 ",
        idle, " by none \u2002 \u2504 mask. Arrows: where each satellite was last, and the way it went; "
        "named if that was in the last half hour. Rings: angle off the boresight; round it the body's sides. "
        "Satellites behind the Earth are left out.",
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
    rows = _by_satellite(seen, np.flatnonzero(seen.off_deg[:, antenna] <= reach_deg))
    data = [_ways(seen, antenna, rows, kind[rows], k) for k in range(3)]
    data += [_mask(mask_deg), _ring_names()]
    last = rows[np.r_[np.diff(seen.satellite[rows]) != 0, True]] if len(rows) else rows
    data += _ends(seen, antenna, rows, last, reach_deg)
    sides = list(side_names(vehicle.boresight_body[antenna]))
    polar = {
        "radialaxis": {"range": [0, reach_deg], "tickvals": list(_RINGS_DEG), "showticklabels": False,
                       "ticks": "", "gridcolor": "--rule", "showline": False, "layer": "below traces"},
        "angularaxis": {"rotation": 90, "direction": "clockwise", "tickvals": [0, 90, 180, 270],
                        "ticktext": sides},
    }  # fmt: skip
    margin = {"l": 60, "r": 60, "t": 30, "b": 30}
    figure = {"data": data, "layout": {"polar": polar, "showlegend": False, "margin": margin}}
    return Plot(f"Sky of antenna {vehicle.names[antenna]}", "", figure, height=400)


def _by_satellite(seen: Sightings, rows: Index) -> I64:
    """Rows by satellite and time."""
    return rows[np.lexsort((seen.instant[rows], seen.satellite[rows]))]


def _flat_deg(seen: Sightings, antenna: int, rows: Index) -> F64:
    """(n, 2) places in the picture, right and up, in degrees off the boresight."""
    off, around = seen.off_deg[rows, antenna], np.radians(seen.round_deg[rows, antenna])
    return np.column_stack([off * np.sin(around), off * np.cos(around)])


def _ways(seen: Sightings, antenna: int, rows: I64, kind: I64, wanted: int) -> Json:
    """Lines of the satellites while they are of one kind; each goes on to where the next kind begins."""
    flat = _flat_deg(seen, antenna, rows)
    joined = (np.diff(seen.satellite[rows]) == 0) & (np.diff(seen.instant[rows]) == 1)
    joined &= np.linalg.norm(np.diff(flat, axis=0), axis=1) < _STEP_DEG
    own = kind == wanted
    follows = np.r_[False, joined & own[:-1]] if len(rows) else own
    shown = np.flatnonzero(own | follows)
    begins = np.flatnonzero(~follows[shown])
    picked = rows[shown]
    times = {t: iso(int(t))[11:19] for t in np.unique(seen.t_ns[picked])}
    pairs = zip(seen.satellite[picked].tolist(), seen.t_ns[picked].tolist(), strict=True)
    words = [f"{satellite_name(s)} {times[t]}" for s, t in pairs]
    for at in begins[:0:-1]:
        words.insert(at, "")
    off, around = (np.insert(v[picked, antenna], begins[1:], np.nan) for v in (seen.off_deg, seen.round_deg))
    colour = _COLOURS[wanted] or antenna_colour(antenna + 1)
    return {
        "type": "scatterpolar", "mode": "lines+markers", "r": numbers(off), "theta": numbers(around),
        "text": words, "hovertemplate": "%{text}, %{r:.0f}\u00b0 off<extra></extra>",
        "line": {"color": colour, "width": _WIDTHS[wanted], "dash": _DASHES[wanted]},
        "marker": {"size": _WIDTHS[wanted], "color": colour},
    }  # fmt: skip


def _ends(seen: Sightings, antenna: int, rows: I64, last: I64, reach_deg: float) -> list[Json]:
    """Where satellites were last, as arrows that show the way they went, and their names."""
    recent = seen.t_ns[last] >= seen.t_ns.max() - _NAMED_NS
    last = last[recent]
    if not len(last):
        return []
    own = seen.tracked[last, antenna]
    before = rows[np.maximum(np.searchsorted(_key(seen, rows), _key(seen, last)) - 1, 0)]
    there, was = _flat_deg(seen, antenna, last), _flat_deg(seen, antenna, before)
    moved = (seen.satellite[before] == seen.satellite[last]) & (
        seen.instant[before] == seen.instant[last] - 1
    )
    way = there - was
    angle = np.degrees(np.arctan2(way[:, 0], way[:, 1]))
    heads = {
        "type": "scatterpolar", "mode": "markers", "hoverinfo": "skip",
        "r": numbers(seen.off_deg[last, antenna]), "theta": numbers(seen.round_deg[last, antenna]),
        "marker": {"symbol": ["arrow" if m else "circle" for m in moved.tolist()],
                   "size": np.where(own, 12, 8).tolist(),
                   "angle": np.where(moved, angle, 0).round(1).tolist(),
                   "color": [antenna_colour(antenna + 1) if o else "--other" for o in own.tolist()]},
    }  # fmt: skip
    px = RADIUS_PX / reach_deg
    centres = names_at_px(there * px, _flat_deg(seen, antenna, rows) * px, reach_deg)
    off = np.hypot(*centres.T) * (reach_deg / RADIUS_PX)
    around = np.degrees(np.arctan2(*centres.T))
    names = [
        {"type": "scatterpolar", "mode": "text", "hoverinfo": "skip", "cliponaxis": False,
         "r": numbers(off[of]), "theta": numbers(around[of]), "textposition": "middle center",
         "text": [satellite_name(s) for s in seen.satellite[last[of]].tolist()],
         "textfont": {"size": 10, "color": colour}}
        for of, colour in ((own, "--ink"), (~own, "--soft")) if of.any()
    ]  # fmt: skip
    return [heads, *names]


def names_at_px(points_px: F64, drawn_px: F64, reach_deg: float) -> F64:
    """(n, 2) centres of the names of points (n, 2) in a sky of RADIUS_PX that shows drawn_px (k, 2); those of
    the rings and of the sides stay clear."""
    ink = labels.Ink.of(drawn_px, RADIUS_PX + max(LABEL_PX))
    return labels.beside(points_px, LABEL_PX, standing_px(reach_deg), ink, RADIUS_PX)


def standing_px(reach_deg: float) -> F64:
    """(7, 2) centres of the names of the rings, and of what the sides' names have of a label's size next to
    the circle."""
    turn = np.radians(_RING_NAMES_AT_DEG)
    rings = np.outer(np.array(_RINGS_DEG) * (RADIUS_PX / reach_deg), (np.sin(turn), np.cos(turn)))
    beside_it, above_it = RADIUS_PX + _SIDE_PX + np.array(LABEL_PX) / 2
    sides = np.array([[beside_it, 0], [-beside_it, 0], [0, above_it], [0, -above_it]])
    return np.concatenate((rings, sides))


def _ring_names() -> Json:
    """Names of the rings, each in the middle of its line."""
    return {"type": "scatterpolar", "mode": "text", "hoverinfo": "skip", "cliponaxis": False,
            "r": list(_RINGS_DEG), "theta": [_RING_NAMES_AT_DEG] * len(_RINGS_DEG),
            "text": [f"{ring}\u00b0" for ring in _RINGS_DEG], "textposition": "middle center",
            "textfont": {"size": 10, "color": "--muted"}}  # fmt: skip


def _key(seen: Sightings, rows: I64) -> I64:
    """Orders rows by satellite and time."""
    return seen.satellite[rows] * (int(seen.instant.max()) + 1) + seen.instant[rows]


def _mask(mask_deg: float) -> Json:
    theta = np.linspace(0, 360, 121)
    return {"type": "scatterpolar", "mode": "lines", "r": numbers(np.full(121, mask_deg)),
            "theta": numbers(theta), "hoverinfo": "skip",
            "line": {"color": "--soft", "width": 1, "dash": "dot"}}  # fmt: skip
