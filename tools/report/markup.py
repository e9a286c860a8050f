"""Elements of a page as values: text is escaped unless it is markup already. What results is sound XML."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape
from importlib import resources

_SLOT = re.compile(r"\{\{(\w+)\}\}")
_VOID = frozenset({"br", "col", "hr", "meta", "rect", "line", "path", "circle", "polygon"})


class Markup(str):
    """Text that is markup and needs no escaping."""

    __slots__ = ()


Child = str | float | Iterable | None


def text(child: Child) -> Markup:
    """A child as markup: None is nothing, an iterable its items one after the other."""
    if child is None:
        return Markup("")
    if isinstance(child, Markup):
        return child
    if isinstance(child, str | int | float):
        return Markup(escape(str(child), quote=False))
    return Markup("".join(map(text, child)))


def _attribute(name: str, value: object) -> str:
    if isinstance(value, float):
        value = f"{value:.6g}"
    return f' {name.rstrip("_").replace("_", "-")}="{escape(str(value))}"'


class _Tag:
    """`tag.p("a < b", class_="note")`: an element for every name. Attributes that are None are left out."""

    def __getattr__(self, name: str):
        def element(*children: Child, **attributes: object) -> Markup:
            head = name + "".join(_attribute(k, v) for k, v in attributes.items() if v is not None)
            inner = text(children)
            if name in _VOID and not inner:
                return Markup(f"<{head}/>")
            return Markup(f"<{head}>{inner}</{name}>")

        return element


tag = _Tag()


def table(
    head: Iterable[Child], rows: Iterable[Iterable[Child]], numbers: Iterable[int] = (), **more
) -> Markup:
    """A table; columns in `numbers` are set flush right."""
    right = set(numbers)

    def row(cell, cells: Iterable[Child]) -> Markup:
        return tag.tr(cell(c, class_="n" if k in right else None) for k, c in enumerate(cells))

    whole = tag.table(tag.thead(row(tag.th, head)), tag.tbody(row(tag.td, r) for r in rows), **more)
    return tag.div(whole, class_="scroll")


def svg(width: float, height: float, *children: Child, title: str, **more) -> Markup:
    """A drawing that shrinks with the page; the title is what a screen reader says."""
    return tag.svg(
        children, xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width:g} {height:g}",
        width=f"{width:g}", role="img", aria_label=title, **more,
    )  # fmt: skip


def figure(drawing: Markup, caption: Child, **more) -> Markup:
    return tag.figure(drawing, tag.figcaption(caption), **more)


def joined(items: Iterable[Child], between: str = ", ") -> Markup:
    """Items with something between them."""
    return text([between if k else None, item] for k, item in enumerate(items))


def own(room: str, name: str) -> str:
    """A template, a style sheet or words that ship with a room of the tools."""
    return resources.files(f"gnss_hil.tools.{room}").joinpath(name).read_text("utf-8")


def filled(template: str, **parts: str) -> str:
    """A page from its template: every `{{name}}` is a part."""
    return _SLOT.sub(lambda slot: parts[slot[1]], template)
