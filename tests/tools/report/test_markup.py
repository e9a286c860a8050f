"""The builder of all pages: text stays text, and what results is sound XML."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

from gnss_hil.tools.report.markup import Markup, filled, joined, table, tag, text


def test_text_is_escaped_and_markup_is_not():
    assert text(["a < b & c", None, 3, tag.b("d>e")]) == "a &lt; b &amp; c3<b>d&gt;e</b>"
    assert tag.p(Markup("<i>x</i>")) == "<p><i>x</i></p>"


def test_attributes_are_escaped_and_those_without_a_value_are_left_out():
    element = tag.rect(x=1.5, class_="a", data_name='<"&', title=None)
    assert element == '<rect x="1.5" class="a" data-name="&lt;&quot;&amp;"/>'
    assert ElementTree.fromstring(element).get("data-name") == '<"&'


def test_a_table_has_its_cells_in_rows():
    root = ElementTree.fromstring(table(("h", "n"), [("a<", 1), ("b", 2)], (1,), class_="t"))
    rows = [[cell.text for cell in row] for row in root.iter("tr")]
    assert rows == [["h", "n"], ["a<", "1"], ["b", "2"]]
    assert [cell.get("class") for cell in root.iter("td")] == [None, "n"] * 2


def test_items_are_joined_as_markup():
    assert joined([tag.b("a"), "<", 1], " & ") == "<b>a</b> &amp; &lt; &amp; 1"


def test_a_template_takes_its_parts_as_they_are():
    assert filled("<p>{{words}}</p>{{words}}", words="{{x}}\\1") == "<p>{{x}}\\1</p>{{x}}\\1"
