"""Documents that the tests of this folder read, each written once."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from functools import cache

from cantools.database import load_string
from cantools.database.can import Database

from gnss_hil.dbc.contract.generate import dbc_text
from gnss_hil.tools.icd.documented_buses import Subject, subject
from gnss_hil.tools.icd.page import document

SVG = "{http://www.w3.org/2000/svg}"


@cache
def subject_of(scenario: str | None = None, receivers: int | None = None) -> Subject:
    return subject(scenario, receivers)


@cache
def read_by_cantools(receivers: int) -> Database:
    """The DBC of as many receivers."""
    return load_string(dbc_text(receivers), "dbc")


@cache
def page(receivers: int | None = None) -> str:
    return document(subject_of(None, receivers))


@cache
def tree(receivers: int | None = None) -> ElementTree.Element:
    """Fails where the page is not well-formed."""
    return ElementTree.fromstring(page(receivers).removeprefix("<!DOCTYPE html>"))


def by_id(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    return {e.get("id"): e for e in root.iter() if e.get("id")}


_BLOCKS = frozenset("p li td th h1 h2 h3 h4 dt dd pre figcaption title style".split())


def words(element: ElementTree.Element) -> str:
    """What is read of an element: blanks as one, blocks apart."""
    return " ".join("".join(_pieces(element)).split())


def _pieces(element: ElementTree.Element) -> Iterator[str]:
    yield element.text or ""
    for child in element:
        yield from _pieces(child)
        yield (" " if child.tag in _BLOCKS else "") + (child.tail or "")
