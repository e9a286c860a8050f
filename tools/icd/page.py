"""The document as one page: cover, contents, chapters. It bears no date: one contract, one file."""

from __future__ import annotations

import hashlib
import re
from html import unescape
from importlib.metadata import version

from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.common.errors import PROGRAM
from gnss_hil.tools.icd.chapters import chapters, render
from gnss_hil.tools.icd.documented_buses import Subject
from gnss_hil.tools.report.markup import Markup, filled, own, table, tag, text

_SUBHEADING = re.compile(r'<h3 id="([^"]+)">(.*?)</h3>')
_SIDES = ("receivers and emulator", "flight software", "bench")


def document(subject: Subject) -> str:
    """The page; well-formed XML that a browser reads as HTML."""
    bodies = [render(chapter, number, subject) for number, chapter in enumerate(chapters(), 1)]
    return filled(
        own("icd", "page.html"),
        hash=subject.contract.hash,
        style=own("report", "palette.css") + own("icd", "style.css"),
        facts=_facts(subject),
        signatures=table(
            ("agreed for", "name", "date", "signature"),
            ((side, "", "", "") for side in _SIDES),
            class_="signatures",
        ),
        contents=_contents(bodies),
        chapters=text(bodies),
    )


def _contents(bodies: list[Markup]) -> Markup:
    """Chapters and the headings within them."""
    items = []
    for number, (chapter, body) in enumerate(zip(chapters(), bodies, strict=True), 1):
        inner = [
            tag.li(tag.a(unescape(title), href=f"#{anchor}")) for anchor, title in _SUBHEADING.findall(body)
        ]
        link = tag.a(tag.span(number, class_="number"), " ", chapter.title, href=f"#{chapter.anchor}")
        items.append(tag.li(link, tag.ol(inner) if inner else None))
    return tag.ol(items)


def _facts(subject: Subject) -> Markup:
    contract = subject.contract
    signals = sum(len(m.signals) for m in contract.messages)
    facts = (
        ("contract hash", tag.code(contract.hash, class_="hash")),
        ("SHA-256 of the DBC", tag.code(hashlib.sha256(contract.codec.text.encode("ascii")).hexdigest())),
        ("receivers", contract.codec.receivers),
        ("messages", f"{len(contract.messages)} of {len(contract.layouts)} kinds, {signals} signals"),
        ("bus", f"classical CAN 2.0A, {BIT_RATE / 1e6:g} Mbit/s, 11-bit identifiers"),
        ("frame budget of", f"scenario {subject.scenario}"),
        ("written by", f"{PROGRAM} {version(PROGRAM)}, gnss-hil icd --html"),
    )
    return table(("", ""), ((tag.b(what), value) for what, value in facts), class_="facts")
