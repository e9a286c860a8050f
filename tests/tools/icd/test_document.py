"""The whole page: complete, sound, alone, and saying what the contract's page says."""

from __future__ import annotations

import re
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.tools.icd import prose
from gnss_hil.tools.icd.chapters import chapters, section
from gnss_hil.tools.icd.messages import number, readers
from gnss_hil.tools.icd.page import document
from tests.support.icd_pages import by_id, page, read_by_cantools, subject_of, tree, words

pytestmark = pytest.mark.verifies(what="Interface control document: the page")

DOCS = Path(__file__).parents[3] / "docs"
SIZES = [1, 4, 8]


@pytest.mark.parametrize("receivers", SIZES)
def test_every_message_of_the_dbc_has_its_place(receivers):
    """Read from the generator's text, not from what the document read."""
    anchors = by_id(tree(receivers))
    for m in read_by_cantools(receivers).messages:
        place = anchors[m.name]
        row = words(place) if place.tag == "section" else words(_row_of(tree(receivers), place))
        assert f"0x{m.frame_id:03X}" in row, m.name
        assert m.senders[0] in row, m.name
        assert all(node in row or "RX1 .. " in row for node in readers(m)), m.name


def _row_of(root, cell):
    return next(tr for tr in root.iter("tr") if cell in list(tr.iter()))


@pytest.mark.verifies(
    "tools/icd/contract.py",
    "tools/icd/messages.py",
    "tools/icd/idmap.py",
    what="Interface control document: messages, signals, value tables, identifiers",
    by="cantools, every message and signal for 1, 4 and 8 receivers",
    status="validated",
)
@pytest.mark.parametrize("receivers", SIZES)
def test_every_signal_of_the_dbc_has_its_row(receivers):
    root, contract = tree(receivers), subject_of(None, receivers).contract
    kind_of = {m.name: layout.name for layout in contract.layouts for m in layout.messages}
    rows = {
        code.get("id"): [words(cell) for cell in tr.iter("td")]
        for tr in root.iter("tr")
        for code in tr.iter("code")
        if "." in code.get("id", "")
    }
    seen = set()
    for m in read_by_cantools(receivers).messages:
        for s in m.signals:
            seen.add(f"{kind_of[m.name]}.{s.name}")
            name, start, bits, sign, step, unit, span, meaning = rows[f"{kind_of[m.name]}.{s.name}"]
            assert (name, start, bits) == (s.name, str(s.start), str(s.length))
            assert sign == ("signed" if s.is_signed else "unsigned")
            assert (step, unit) == (number(s.scale), s.unit or "")
            assert span == f"{number(s.minimum)} .. {number(s.maximum)}"
            assert s.comment in meaning
            assert bool(s.choices) == ("(" in meaning.removeprefix(s.comment))
    assert seen == set(rows)


def test_numbers_lose_no_digit():
    assert number(1.25e-07) == "1.25·10⁻⁷"
    assert number(439804651.1103) == "439804651.1103"
    assert number(-12345.678) == "−12345.678"


def test_value_tables_are_those_of_the_dbc():
    anchors = by_id(tree())
    for name, table in read_by_cantools(4).dbc.value_tables.items():
        cells = [words(cell) for cell in anchors[f"values-{name}"].iter("td")]
        pairs = dict(zip(cells[::2], cells[1::2], strict=True))
        assert pairs == {str(raw): str(label) for raw, label in table.items()}


@pytest.mark.parametrize("receivers", SIZES)
def test_anchors_are_unique_and_every_link_leads_somewhere(receivers):
    root = tree(receivers)
    anchors = Counter(e.get("id") for e in root.iter() if e.get("id"))
    assert [name for name, count in anchors.items() if count > 1] == []
    links = [e.get("href") for e in root.iter() if e.get("href")]
    assert len(links) > 200
    assert {link for link in links if not link.startswith("#") or link[1:] not in anchors} == set()


def test_every_chapter_is_in_the_contents():
    listed = [a.get("href") for a in tree().find("body/nav").iter("a")]
    assert [f"#{chapter.anchor}" for chapter in chapters()] == [h for h in listed if h in _chapter_links()]
    assert len(listed) == len(set(listed)) > 2 * len(chapters())


def _chapter_links():
    return {f"#{chapter.anchor}" for chapter in chapters()}


class _Resources(HTMLParser):
    """What a browser would run, or fetch."""

    def __init__(self):
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attributes):
        self.found += [tag] if tag in ("script", "link", "img", "iframe", "object", "image", "use") else []
        for name, value in attributes:
            if name.startswith("on") or name in ("src", "srcset", "style"):
                self.found.append(f"{tag} {name}={value}")


def test_nothing_is_fetched_and_nothing_runs():
    parser = _Resources()
    parser.feed(page())
    assert parser.found == []
    assert re.findall(r"https?://(?!www\.w3\.org/2000/svg)\S+", page()) == []
    assert re.findall(r"@import|url\((?!#)", page()) == []


def test_it_is_less_than_a_megabyte():
    assert len(page(8).encode()) < 1_000_000


def test_the_same_contract_is_the_same_file():
    assert document(subject_of()) == page()


@pytest.mark.parametrize("receivers", SIZES)
def test_the_cover_names_the_contract(receivers):
    cover = words(next(tree(receivers).iter("header")))
    assert f"contract hash 0x{codec(receivers).hash:08X}" in cover
    assert f"receivers {receivers} " in cover


def test_the_words_are_those_of_the_contracts_page():
    """Every word of every section but those that are drawn or computed instead."""
    spoken = words(tree())
    page_ = (DOCS / "contract.md").read_text("utf-8")
    assert set(prose.sections()) == set(re.findall(r"^## (.+)$", page_, re.MULTILINE))
    for title, markdown in prose.sections().items():
        if title == "Frame budget":
            continue
        for line in re.sub(r"^```math$.*?^```$", "", markdown, flags=re.MULTILINE | re.DOTALL).splitlines():
            if line.strip() and not line.startswith(("    ", "|--")):
                bare = re.sub(r"\[([^]]*)\]\([^)]*\)|[`*]", r"\1", line)
                for piece in bare.strip("|- ").split("|"):
                    assert " ".join(piece.split()) in spoken, f"{title}: {piece}"


def test_prose_shapes_become_elements():
    shown = prose.render(
        "One `a<b` and\n**two**.\n- x\n  y\n- z\n\n| h | n |\n|---|---:|\n| 1 | 2 |\n\n    code <\n"
    )
    shown = " ".join(shown.split()).replace("> <", "><")
    assert shown.startswith(
        "<p>One <code>a&lt;b</code> and <strong>two</strong>.</p><ul><li>x y</li><li>z</li></ul>"
    )
    assert '<th>h</th><th class="n">n</th>' in shown
    assert '<td>1</td><td class="n">2</td>' in shown
    assert shown.endswith("</table></div><pre>code &lt;</pre>")


def test_markup_within_the_words_is_shown_and_not_obeyed():
    assert prose.render("a <b>c</b> & d").strip() == "<p>a &lt;b&gt;c&lt;/b&gt; &amp; d</p>"


def test_a_section_that_is_not_there_is_a_fault():
    with pytest.raises(KeyError):
        section("No such section")
