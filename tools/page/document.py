"""A page as one file: style, script, library and data inside, and a policy that lets nothing in or out."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib import resources
from itertools import count
from pathlib import Path

from tools.page.figure import Json, Plot

_POLICY = "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:"
_AXIS = {
    "gridcolor": "--grid", "linecolor": "--rule", "zerolinecolor": "--rule", "tickcolor": "--rule",
    "automargin": True, "title": {"standoff": 8, "font": {"size": 12}}, "tickfont": {"size": 11},
}  # fmt: skip
TEMPLATE: Json = {
    "layout": {
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)", "hovermode": "closest",
        "font": {"family": "system-ui, -apple-system, Segoe UI, Helvetica Neue, Arial, sans-serif",
                 "size": 12, "color": "--soft"},
        "margin": {"l": 56, "r": 12, "t": 34, "b": 44}, "xaxis": _AXIS, "yaxis": _AXIS, "dragmode": "zoom",
        "legend": {"orientation": "h", "x": 0, "y": 1, "yanchor": "bottom", "itemsizing": "constant",
                   "font": {"size": 12}, "tracegroupgap": 0},
        "hoverlabel": {"bgcolor": "--paper", "bordercolor": "--rule", "font": {"color": "--ink"}},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": "--muted", "activecolor": "--ink"},
        "polar": {"bgcolor": "rgba(0,0,0,0)",
                  "radialaxis": {"gridcolor": "--grid", "linecolor": "--rule", "tickfont": {"size": 10}},
                  "angularaxis": {"gridcolor": "--grid", "linecolor": "--rule", "tickfont": {"size": 11}}},
    }
}  # fmt: skip


def slot(plot: Plot, name: str) -> str:
    """The place of one plot in a page."""
    body = (
        f'<div class="plot" id="{name}" style="height:{plot.height}px"></div>'
        if plot.figure is not None
        else ""
    )
    note = f'<p class="note">{escape(plot.note)}</p>' if plot.note else ""
    wide = " wide" if plot.wide else ""
    return f'<figure class="card{wide}"><figcaption><h3>{escape(plot.title)}</h3>{note}</figcaption>{body}</figure>'


def table(head: Sequence[str], rows: Iterable[Sequence[str]], text: Sequence[int] = (0,)) -> str:
    """An HTML table of plain text; `text` are the columns that are words."""
    cells = [
        "".join(f"<td{' class=text' if i in text else ''}>{escape(c)}</td>" for i, c in enumerate(row))
        for row in rows
    ]
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


@dataclass(slots=True)
class Page:
    """HTML in the order in which it is added, and the plots it has places for."""

    title: str
    _body: list[str] = field(default_factory=list)
    _plots: list[Json] = field(default_factory=list)
    _ids: count = field(default_factory=count)

    def add(self, html: str) -> None:
        self._body.append(html)

    def add_plots(self, plots: Iterable[Plot | None], family: str = "", style: str = "") -> None:
        """A grid of plots; those over time of one family are zoomed together."""
        slots = []
        for plot in plots:
            if plot is None:
                continue
            name = f"plot-{next(self._ids)}"
            slots.append(slot(plot, name))
            if plot.figure is not None:
                over_time = plot.figure["layout"].get("xaxis", {}).get("type") == "date"
                self._plots.append({"id": name, "height": plot.height, "figure": plot.figure,
                                    "family": family if over_time else ""})  # fmt: skip
        self.add(f'<div class="grid {style}">{"".join(slots)}</div>')

    def html(self) -> str:
        from plotly.offline import get_plotlyjs

        own = resources.files("tools.page")
        plots = json.dumps(
            {"template": TEMPLATE, "plots": self._plots}, separators=(",", ":"), allow_nan=False
        )
        return (
            f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(self.title)}</title>\n<style>\n{(own / 'page.css').read_text('utf-8')}</style>\n</head>\n"
            f"<body>\n<main>\n{chr(10).join(self._body)}\n"
            '<p id="trouble" class="bad" hidden>This browser is too old to unpack the plots: they need one of 2023 '
            "or later.</p>\n<noscript><p class=bad>The plots need JavaScript; it is inside this file.</p></noscript>\n"
            f"</main>\n"
            f'<script type="text/plain" id="plotly">{_packed(get_plotlyjs())}</script>\n'
            f'<script type="text/plain" id="plots">{_packed(plots)}</script>\n'
            f"<script>\n{(own / 'page.js').read_text('utf-8')}</script>\n</body>\n</html>\n"
        )

    def write(self, path: Path) -> None:
        """The page, there whole or not at all."""
        draft = path.with_name(f".{path.name}.draft")
        try:
            draft.write_text(self.html(), "utf-8")
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)


def _packed(text: str) -> str:
    return base64.b64encode(gzip.compress(text.encode(), 6, mtime=0)).decode()
