"""A page as one file: style, script, library and data inside, and a policy that lets nothing in or out."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path

from gnss_hil.tools.common.whole_file import draft_of
from gnss_hil.tools.report.markup import Child, Markup, filled, own, tag, text
from gnss_hil.tools.report.plot import Json, Plot


def slot(plot: Plot, name: str) -> Markup:
    """The place of one plot in a page."""
    round_ = plot.figure is not None and "polar" in plot.figure["layout"]
    place = tag.div(class_="plot round" if round_ else "plot", id=name, style=f"height:{plot.height}px")
    head = tag.figcaption(tag.h3(plot.title), note(plot.note) if plot.note else None)
    return tag.figure(head, place, class_="card wide" if plot.wide else "card")


def note(words: str) -> Markup:
    """A paragraph below a title."""
    return tag.p(words, class_="note")


def lead(words: str) -> Markup:
    """A paragraph below the page's title."""
    return tag.p(words, class_="lead")


def card(title: str, *children: Child, style: str = "card") -> Markup:
    """A part of the page in a frame of its own."""
    return tag.section(tag.h3(title), children, class_=style)


@dataclass(slots=True)
class Page:
    """What is added, in its order, and the plots it has places for."""

    title: str
    _body: list[Markup] = field(default_factory=list)
    _plots: list[Json] = field(default_factory=list)

    def add(self, *children: Child) -> None:
        self._body.append(text(children))

    def add_plots(self, plots: Iterable[Plot | None], family: str = "") -> None:
        """A grid of plots, and one list of those there is nothing to draw of; those over time of one family
        are zoomed together."""
        slots, missing = [], []
        for plot in filter(None, plots):
            if plot.figure is None:
                missing.append(tag.li(f"{plot.title}: {plot.note}"))
                continue
            name = f"plot-{len(self._plots)}"
            slots.append(slot(plot, name))
            over_time = plot.figure["layout"].get("xaxis", {}).get("type") == "date"
            self._plots.append({"id": name, "height": plot.height, "figure": plot.figure,
                                "family": family if over_time else ""})  # fmt: skip
        if slots:
            self.add(tag.div(slots, class_="grid"))
        if missing:
            self.add(card("Not drawn", tag.ul(missing)))

    def html(self) -> str:
        plotly = resources.files("gnss_hil.tools.report").joinpath("plotly.min.js.gz").read_bytes()
        return filled(
            own("report", "page.html"),
            title=text(self.title),
            style=own("report", "palette.css") + own("report", "page.css"),
            body="\n".join(self._body),
            plotly=_base64(plotly),
            plots=_base64(_packed(json.dumps(self._plots, separators=(",", ":"), allow_nan=False))),
            script=own("report", "page.js"),
        )

    def write(self, path: Path) -> None:
        """The page, there whole or not at all."""
        with draft_of(path) as draft:
            draft.write_text(self.html(), "utf-8")


def _packed(text: str) -> bytes:
    return gzip.compress(text.encode(), 6, mtime=0)


def _base64(packed: bytes) -> str:
    return base64.b64encode(packed).decode()
