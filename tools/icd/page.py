"""The document as one page: cover, contents, chapters. It bears no date: one contract, one file."""

from __future__ import annotations

import hashlib
import re
from html import unescape
from importlib import resources
from importlib.metadata import version

from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.common.errors import PROGRAM
from gnss_hil.tools.icd.chapters import chapters, render
from gnss_hil.tools.icd.subject import Subject
from gnss_hil.tools.report.markup import Markup, table, tag, text

_SUBHEADING = re.compile(r'<h3 id="([^"]+)">(.*?)</h3>')

_HATCH = Markup(
    '<svg width="0" height="0" aria-hidden="true" class="defs"><defs><pattern id="hatch" width="6" '
    'height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
    '<rect width="6" height="6" class="paper"/>'
    '<line x1="0" y1="0" x2="0" y2="6" class="stroke"/></pattern></defs></svg>'
)


def document(subject: Subject) -> str:
    """The page; well-formed XML that a browser reads as HTML."""
    bodies = [render(chapter, number, subject) for number, chapter in enumerate(chapters(), 1)]
    style = Markup(resources.files("gnss_hil.tools.icd").joinpath("style.css").read_text("utf-8"))
    head = tag.head(
        tag.meta(charset="utf-8"),
        tag.meta(name="viewport", content="width=device-width, initial-scale=1"),
        tag.meta(name="color-scheme", content="light dark"),
        tag.title(f"Interface control document {subject.contract.hash}"),
        tag.style(style),
    )
    body = tag.body(_HATCH, _cover(subject), tag.nav(_contents(bodies)), tag.main(bodies))
    return f"<!DOCTYPE html>\n{tag.html(head, body, lang='en')}\n"


def _contents(bodies: list[Markup]) -> Markup:
    """Chapters and the headings within them."""
    items = []
    for number, (chapter, body) in enumerate(zip(chapters(), bodies, strict=True), 1):
        inner = [
            tag.li(tag.a(unescape(title), href=f"#{anchor}")) for anchor, title in _SUBHEADING.findall(body)
        ]
        link = tag.a(tag.span(number, class_="number"), " ", chapter.title, href=f"#{chapter.anchor}")
        items.append(tag.li(link, tag.ol(inner) if inner else None))
    return text((tag.p("Contents", class_="contents"), tag.ol(items)))


def _cover(subject: Subject) -> Markup:
    contract = subject.contract
    layouts = len(contract.layouts)
    signals = sum(len(m.signals) for m in contract.messages)
    facts = (
        ("contract hash", tag.code(contract.hash, class_="hash")),
        ("SHA-256 of the DBC", tag.code(hashlib.sha256(contract.codec.text.encode("ascii")).hexdigest())),
        ("receivers", contract.codec.receivers),
        ("messages", f"{len(contract.messages)} of {layouts} kinds, {signals} signals"),
        ("bus", f"classical CAN 2.0A, {BIT_RATE / 1e6:g} Mbit/s, 11-bit identifiers"),
        ("frame budget of", f"scenario {subject.scenario}"),
        ("written by", f"{PROGRAM} {version(PROGRAM)}, gnss-hil icd --html"),
    )
    signatures = ((side, "", "", "") for side in ("receivers and emulator", "flight software", "bench"))
    return tag.header(
        tag.p("Interface control document", class_="kicker"),
        tag.h1("Satellite navigation bus"),
        tag.p("Receivers, attitude unit and time source to flight software, over CAN", class_="subtitle"),
        table(("", ""), ((tag.b(what), value) for what, value in facts), class_="facts"),
        table(("agreed for", "name", "date", "signature"), signatures, class_="signatures"),
        class_="cover",
    )
