"""Where the craft was: over the ground, in its orbit; and its sky, antenna by antenna."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from dbc.gpstime import iso
from dbc.satellites import name as satellite_name
from flightsw.earth import EQUATOR_M
from tools.page.craft import Craft
from tools.page.figure import Json, Plot, antenna_colour, axis, layout, line, numbers
from tools.page.motion import geodetic, inertial
from tools.page.sky import side_names
from tools.page.thin import evenly

_POINTS = 4000


@cache
def land_deg() -> tuple[list[float | None], list[float | None]]:
    """Longitudes and latitudes of coastlines, rings apart by None. Source: in land.json."""
    rings = json.loads((resources.files("tools.page") / "land.json").read_text("utf-8"))["rings"]
    lon: list[float | None] = []
    lat: list[float | None] = []
    for ring in rings:
        lon += [v / 10 for v in ring[0::2]] + [None]
        lat += [v / 10 for v in ring[1::2]] + [None]
    return lon[:-1], lat[:-1]


def _with_gaps(values: NDArray, breaks: NDArray[np.int64]) -> NDArray:
    """A gap in front of each of these rows."""
    return np.insert(values, breaks, np.nan)


def _thinned(craft: Craft) -> NDArray[np.int64]:
    known = np.flatnonzero(~np.isnan(craft.here_m).any(axis=1))
    return known[evenly(len(known), _POINTS)]


def ground_track(craft: Craft) -> Plot:
    title, rows = "Ground track", _thinned(craft)
    if not len(rows):
        return Plot.missing(title, "Neither fixes nor truth say where the craft was.")
    lon, lat, _ = geodetic(craft.here_m[rows])
    fixed = ~np.isnan(craft.position_m[rows, 0])
    breaks = np.flatnonzero(np.abs(np.diff(lon)) > 180) + 1
    coast_lon, coast_lat = land_deg()
    coast = {"type": "scatter", "mode": "lines", "x": coast_lon, "y": coast_lat, "fill": "toself",
             "fillcolor": "--land", "line": {"color": "--coast", "width": 0.6}, "hoverinfo": "skip",
             "showlegend": False}  # fmt: skip
    said = "%{y:.2f} deg N, %{x:.2f} deg E<extra></extra>"
    data = [coast]
    for name, which, colour, width in (("fix", fixed, "--accent", 2.2), ("no fix", ~fixed, "--bad", 3.5)):
        if which.any():
            x, y = (_with_gaps(np.where(which, v, np.nan), breaks) for v in (lon, lat))
            # one lonely epoch has no line: a point shows it
            data.append(line(name, numbers(x), numbers(y), colour, mode="lines+markers",
                             marker={"size": width, "color": colour}, line={"width": width},
                             hovertemplate=said))  # fmt: skip
    for name, at, symbol in (("begin", 0, "circle-open"), ("end", -1, "circle")):
        data.append({"type": "scatter", "mode": "markers", "name": name, "x": [float(lon[at])],
                     "y": [float(lat[at])], "hovertemplate": said,
                     "marker": {"symbol": symbol, "size": 10, "color": "--ink", "line": {"width": 2}}})  # fmt: skip
    degrees = {"ticksuffix": "°", "zeroline": False}
    return Plot(
        title, "Below the craft, WGS-84: by its fixes, by truth where there is none.",
        {"data": data, "layout": layout(
            axis("longitude", range=[-180, 180], dtick=60, constrain="domain", **degrees),
            axis("latitude", range=[-90, 90], dtick=30, scaleanchor="x", constrain="domain", **degrees))},
        height=400,
    )  # fmt: skip


def orbit(craft: Craft) -> Plot:
    """The orbit in its own plane, seen against the motion: the craft goes round anticlockwise."""
    title, rows = "Orbit", _thinned(craft)
    if len(rows) < 3:
        return Plot.missing(title, "Too few places are known to draw an orbit.")
    place = inertial(craft.here_m[rows], craft.t_ns[rows])
    normal = np.cross(place[:-1], place[1:]).sum(axis=0)
    normal /= np.linalg.norm(normal)
    node = np.cross([0.0, 0.0, 1.0], normal)
    node = place[0] - (place[0] @ normal) * normal if np.linalg.norm(node) < 1e-6 else node
    node /= np.linalg.norm(node)
    x_km, y_km = place @ node / 1e3, place @ np.cross(normal, node) / 1e3
    fixed = ~np.isnan(craft.position_m[rows, 0])
    height_km = geodetic(craft.here_m[rows])[2] / 1e3
    radius_km = EQUATOR_M / 1e3
    globe = {"type": "circle", "x0": -radius_km, "x1": radius_km, "y0": -radius_km, "y1": radius_km,
             "fillcolor": "--land", "line": {"color": "--coast", "width": 1}, "layer": "below"}  # fmt: skip
    data = []
    for name, which, colour, width in (("fix", fixed, "--accent", 2.2), ("no fix", ~fixed, "--bad", 3.5)):
        if which.any():
            x, y = (numbers(np.where(which, v, np.nan)) for v in (x_km, y_km))
            data.append(line(name, x, y, colour, mode="lines+markers", line={"width": width},
                             marker={"size": width, "color": colour}, customdata=numbers(height_km),
                             hovertemplate="%{customdata:.1f} km high<extra></extra>"))  # fmt: skip
    for name, at, symbol in (("begin", 0, "circle-open"), ("end", -1, "circle")):
        data.append({"type": "scatter", "mode": "markers", "name": name, "x": [float(x_km[at])],
                     "y": [float(y_km[at])], "hoverinfo": "skip",
                     "marker": {"symbol": symbol, "size": 10, "color": "--ink", "line": {"width": 2}}})  # fmt: skip
    inclination = np.degrees(np.arctan2(np.hypot(normal[0], normal[1]), normal[2]))
    limit = 1.08 * float(max(np.hypot(x_km, y_km).max(), radius_km))
    view = {"range": [-limit, limit], "constrain": "domain", "zeroline": False}
    return Plot(
        title,
        f"In its plane, not turning with the Earth; to the right the ascending node. Inclination "
        f"{inclination:.2f} deg, {height_km.min():,.1f} to {height_km.max():,.1f} km high.".replace(",", " "),
        {"data": data, "layout": layout(axis("km", **view), axis("km", scaleanchor="x", **view),
                                        shapes=[globe])},
        height=400,
    )  # fmt: skip


_CLASSES = (
    ("tracked by nobody", "--idle", 3),
    ("tracked by another antenna", "--other", 3),
    ("tracked by this antenna", "", 4),
)


def skies(craft: Craft) -> list[Plot]:
    """A sky for each antenna."""
    if craft.sightings is None:
        return [
            Plot.missing(
                "Sky of the antennas", "This run kept no table of channels (it was played without a log)."
            )
        ]
    if not len(craft.sightings.t_ns):
        return [
            Plot.missing("Sky of the antennas", "No instant has both an attitude and a place of the craft.")
        ]
    return [_sky(craft, antenna) for antenna in range(craft.vehicle.antennas)]


def _sky(craft: Craft, antenna: int) -> Plot:
    seen, vehicle = craft.sightings, craft.vehicle
    mask_deg = float(np.degrees(vehicle.mask_rad[antenna]))
    reach_deg = max(90.0, mask_deg)
    here = seen.tracked[:, antenna]
    kind = np.where(here, 2, np.where(seen.tracked.any(axis=1), 1, 0))
    inside = seen.off_deg[:, antenna] <= reach_deg
    data = []
    for number, (name, colour, size) in enumerate(_CLASSES):
        rows = np.flatnonzero(inside & (kind == number))
        data.append({
            "type": "scatterpolar", "mode": "markers", "name": name,
            "r": numbers(seen.off_deg[rows, antenna]), "theta": numbers(seen.round_deg[rows, antenna]),
            "text": [f"{satellite_name(s)} {iso(int(t))[11:19]}"
                     for s, t in zip(seen.satellite[rows], seen.t_ns[rows], strict=True)],
            "hovertemplate": "%{text}, %{r:.0f} deg off<extra></extra>",
            "marker": {"size": size, "color": colour or antenna_colour(antenna + 1)},
        })  # fmt: skip
    last = np.flatnonzero(inside & here & (seen.instant == seen.instant.max()))
    data.append({"type": "scatterpolar", "mode": "markers+text", "showlegend": False, "hoverinfo": "skip",
                 "r": numbers(seen.off_deg[last, antenna]), "theta": numbers(seen.round_deg[last, antenna]),
                 "text": [satellite_name(s) for s in seen.satellite[last]], "textposition": "top center",
                 "textfont": {"size": 10, "color": "--ink"},
                 "marker": {"size": 8, "color": antenna_colour(antenna + 1),
                            "line": {"color": "--paper", "width": 1}}})  # fmt: skip
    data.append({"type": "scatterpolar", "mode": "lines", "name": f"mask, {mask_deg:g} deg",
                 "r": [mask_deg] * 121, "theta": np.linspace(0, 360, 121).tolist(), "hoverinfo": "skip",
                 "line": {"color": "--ink", "width": 1, "dash": "dot"}})  # fmt: skip
    polar = {
        "radialaxis": {"range": [0, reach_deg], "dtick": 30, "angle": 45, "tickangle": 0, "ticksuffix": "°"},
        "angularaxis": {"rotation": 90, "direction": "clockwise", "tickvals": [0, 90, 180, 270],
                        "ticktext": list(side_names(vehicle.boresight_body[antenna]))},
    }  # fmt: skip
    return Plot(
        f"Sky of antenna {vehicle.names[antenna]}", "", {"data": data, "layout": {"polar": polar}}, 340
    )
