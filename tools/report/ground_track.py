"""Where the craft was: over the ground and in its orbit."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.flightsw.orbit.earth import EQUATOR_M
from gnss_hil.tools.report.craft import Craft
from gnss_hil.tools.report.decimate import evenly
from gnss_hil.tools.report.frames import geodetic, inertial
from gnss_hil.tools.report.plot import Json, Plot, axis, layout, line, numbers

_POINTS = 4000

NO_PLACE = "Too few places of the craft, by fixes or by truth, to draw them."


@cache
def land_deg() -> tuple[list[float | None], list[float | None]]:
    """Longitudes and latitudes of coastlines, rings apart by None. Source: in land.json."""
    rings = json.loads((resources.files("gnss_hil.tools.report") / "land.json").read_text("utf-8"))["rings"]
    lon: list[float | None] = []
    lat: list[float | None] = []
    for ring in rings:
        lon += [v / 10 for v in ring[0::2]] + [None]
        lat += [v / 10 for v in ring[1::2]] + [None]
    return lon[:-1], lat[:-1]


def _thinned(craft: Craft) -> I64:
    there = np.flatnonzero(~np.isnan(craft.here_m).any(axis=1))
    return there[evenly(len(there), _POINTS)]


_PATHS = (("fix", True, "--accent", 2.2), ("no fix", False, "--bad", 3.5))
_ENDS = (("begin", 0, "circle-open"), ("end", -1, "circle"))


def _path(x: NDArray, y: NDArray, fixed: Bool, **more) -> list[Json]:
    """A craft's way: where it had a fix and where it had none; an epoch by itself is a point."""
    parts = []
    for name, wanted, colour, width in _PATHS:
        which = fixed == wanted
        if which.any():
            east, north = (numbers(np.where(which, v, np.nan)) for v in (x, y))
            style = {"line": {"width": width}, "marker": {"size": width, "color": colour}}
            parts.append(line(name, east, north, colour, mode="lines+markers", **style, **more))
    return parts


def _ends(x: NDArray, y: NDArray) -> list[Json]:
    """Where it began and where it ended."""
    style = {"size": 10, "color": "--ink", "line": {"width": 2}}
    return [
        {"type": "scatter", "mode": "markers", "name": name, "x": [float(x[at])], "y": [float(y[at])],
         "hoverinfo": "skip", "marker": {"symbol": symbol, **style}}
        for name, at, symbol in _ENDS
    ]  # fmt: skip


def ground_track(craft: Craft) -> Plot:
    title, rows = "Ground track", _thinned(craft)
    if not len(rows):
        return Plot.missing(title, NO_PLACE)
    lon, lat, _ = geodetic(craft.here_m[rows])
    fixed = ~np.isnan(craft.position_m[rows, 0])
    breaks = np.flatnonzero(np.abs(np.diff(lon)) > 180) + 1
    coast_lon, coast_lat = land_deg()
    coast = {"type": "scatter", "mode": "lines", "x": coast_lon, "y": coast_lat, "fill": "toself",
             "fillcolor": "--land", "line": {"color": "--coast", "width": 0.6}, "hoverinfo": "skip",
             "showlegend": False}  # fmt: skip
    east, north = (np.insert(v, breaks, np.nan) for v in (lon, lat))
    path = _path(east, north, np.insert(fixed, breaks, False),
                 hovertemplate="%{y:.2f}° N, %{x:.2f}° E<extra></extra>")  # fmt: skip
    degrees = {"ticksuffix": "°", "zeroline": False, "constrain": "domain"}
    x = axis("longitude, east", range=[-180, 180], dtick=60, **degrees)
    y = axis("latitude, north", range=[-90, 90], dtick=30, scaleanchor="x", **degrees)
    return Plot(
        title,
        "Below the craft, WGS-84: by its fixes, by truth where there is none.",
        {"data": [coast, *path, *_ends(lon, lat)], "layout": layout(x, y)},
        height=370,
    )


def orbit(craft: Craft) -> Plot:
    """The orbit in its own plane, seen from where the craft goes round anticlockwise."""
    title, rows = "Orbit", _thinned(craft)
    if len(rows) < 3:
        return Plot.missing(title, NO_PLACE)
    place = inertial(craft.here_m[rows], craft.t_ns[rows])
    right, up, normal = orbit_plane(place)
    x_km, y_km = place @ right / 1e3, place @ up / 1e3
    height_km = geodetic(craft.here_m[rows])[2] / 1e3
    radius_km = EQUATOR_M / 1e3
    globe = {"type": "circle", "x0": -radius_km, "x1": radius_km, "y0": -radius_km, "y1": radius_km,
             "fillcolor": "--land", "line": {"color": "--coast", "width": 1}, "layer": "below"}  # fmt: skip
    path = _path(x_km, y_km, ~np.isnan(craft.position_m[rows, 0]), customdata=numbers(height_km),
                 hovertemplate="%{customdata:.1f} km high<extra></extra>")  # fmt: skip
    inclination = np.degrees(np.arctan2(np.hypot(normal[0], normal[1]), normal[2]))
    limit = 1.08 * float(max(np.hypot(x_km, y_km).max(), radius_km))
    view = {"range": [-limit, limit], "constrain": "domain", "zeroline": False, "nticks": 6}
    axes = layout(axis("km", **view), axis("km", scaleanchor="x", **view), shapes=[globe])
    low, high = (f"{v:,.1f}".replace(",", " ") for v in (height_km.min(), height_km.max()))
    return Plot(
        title,
        f"In its plane, not turning with the Earth; the ascending node is on the right. "
        f"Inclination {inclination:.2f}°, {low} to {high} km high.",
        {"data": [*path, *_ends(x_km, y_km)], "layout": axes},
        height=370,
    )


def orbit_plane(place: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Unit vectors to the ascending node, a quarter orbit behind it, and along the normal, of inertial places
    (n, 3) by time. An equatorial orbit has no node: there it is the first place."""
    normal = np.cross(place[:-1], place[1:]).sum(axis=0)
    normal /= np.linalg.norm(normal)
    node = np.cross([0.0, 0.0, 1.0], normal)
    if np.linalg.norm(node) < 1e-6:
        node = place[0] - (place[0] @ normal) * normal
    node /= np.linalg.norm(node)
    return node, np.cross(normal, node), normal
