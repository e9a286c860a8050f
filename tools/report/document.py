"""A page as one file: style, script, library and data inside, and a policy that lets nothing in or out."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib import resources
from itertools import count
from pathlib import Path

from gnss_hil.tools.report.figure import Json, Plot

_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:"
)
_AXIS = {
    "gridcolor": "--grid", "linecolor": "--rule", "zerolinecolor": "--rule", "tickcolor": "--rule",
    "automargin": True, "title": {"standoff": 8, "font": {"size": 12}}, "tickfont": {"size": 11},
}  # fmt: skip
_SLOT = re.compile(r"\{\{(\w+)\}\}")
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
    place = f'<div class="plot" id="{name}" style="height:{plot.height}px"></div>' if plot.figure else ""
    words = note(plot.note) if plot.note else ""
    head = f"<figcaption><h3>{escape(plot.title)}</h3>{words}</figcaption>"
    return f'<figure class="card{" wide" if plot.wide else ""}">{head}{place}</figure>'


def note(text: str) -> str:
    """A paragraph of plain text below a title."""
    return f'<p class="note">{escape(text)}</p>'


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """An HTML table of plain text, words in the first column."""
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def card(title: str, html: str, style: str = "") -> str:
    """HTML in a frame of its own."""
    return f'<section class="card {style}"><h3>{escape(title)}</h3>{html}</section>'


@dataclass(slots=True)
class Page:
    """HTML in the order in which it is added, and the plots it has places for."""

    title: str
    _body: list[str] = field(default_factory=list)
    _plots: list[Json] = field(default_factory=list)
    _ids: count = field(default_factory=count)

    def add(self, html: str) -> None:
        self._body.append(html)

    def add_plots(self, plots: Iterable[Plot | None], family: str = "") -> None:
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
        self.add(f'<div class="grid">{"".join(slots)}</div>')

    def html(self) -> str:
        own = resources.files("gnss_hil.tools.report")
        document = {"template": TEMPLATE, "plots": self._plots}
        parts = {
            "policy": _POLICY,
            "title": escape(self.title),
            "style": (own / "page.css").read_text("utf-8"),
            "body": "\n".join(self._body),
            "plotly": _base64((own / "plotly.min.js.gz").read_bytes()),
            "plots": _base64(_packed(json.dumps(document, separators=(",", ":"), allow_nan=False))),
            "script": (own / "page.js").read_text("utf-8"),
        }
        return _SLOT.sub(lambda found: parts[found[1]], (own / "page.html").read_text("utf-8"))

    def write(self, path: Path) -> None:
        """The page, there whole or not at all."""
        draft = path.with_name(f".{path.name}.draft")
        try:
            draft.write_text(self.html(), "utf-8")
            draft.replace(path)
        except OSError as error:
            error.filename = str(path)  # nobody knows the draft
            raise
        finally:
            draft.unlink(missing_ok=True)


def _packed(text: str) -> bytes:
    return gzip.compress(text.encode(), 6, mtime=0)


def _base64(packed: bytes) -> str:
    return base64.b64encode(packed).decode()
