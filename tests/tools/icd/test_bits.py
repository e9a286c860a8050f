"""The drawn bits are those which cantools sets."""

from __future__ import annotations

from itertools import pairwise

import pytest

from gnss_hil.tools.icd import bits
from tests.support.icd_pages import by_id, read_by_cantools, subject_of, tree


def drawn(section) -> dict[tuple[str, int], int]:
    """(signal, weight) -> bit of the frame, from the cells of a message's drawing."""
    cells = [e for e in section.iter() if e.get("data-bit")]
    found = {(c.get("data-signal"), int(c.get("data-weight"))): int(c.get("data-bit")) for c in cells}
    assert len(found) == len(cells)
    return found


def set_by_cantools(message) -> dict[tuple[str, int], int]:
    """The same, from payloads that cantools encodes with one bit of one signal set."""
    nothing = {s.name: 0 for s in message.signals}
    found = {}
    for s in message.signals:
        for k in range(s.length):
            raw = 1 << k if not (s.is_signed and k == s.length - 1) else -(1 << k)
            payload = message.encode({**nothing, s.name: raw}, scaling=False, strict=False)
            (bit,) = [b for b in range(64) if payload[b // 8] >> b % 8 & 1]
            found[s.name, k] = bit
    return found


@pytest.mark.verifies(
    "tools/icd/bits.py",
    "tools/icd/protection.py",
    what="Interface control document: bits, worked CRC",
    by="cantools, one bit of one signal at a time; autosar-e2e",
    status="validated",
)
@pytest.mark.parametrize("receivers", [4, 8])
def test_drawn_bits_are_those_cantools_sets(receivers):
    anchors = by_id(tree(receivers))
    layouts = {
        m.name: layout.name
        for layout in subject_of(None, receivers).contract.layouts
        for m in layout.messages
    }
    for message in read_by_cantools(receivers).messages:
        assert drawn(anchors[layouts[message.name]]) == set_by_cantools(message), message.name


def test_a_cell_is_where_its_bit_is():
    """Byte 0 on top; bit 7 to the left."""
    for section in (by_id(tree())["RANGE"], by_id(tree())["HEARTBEAT"]):
        for cell in (e for e in section.iter() if e.get("data-bit")):
            bit = int(cell.get("data-bit"))
            column = (float(cell.get("x")) - bits.place(7)[0]) / float(cell.get("width"))
            row = (float(cell.get("y")) - bits.place(7)[1]) / float(cell.get("height"))
            assert (row, column) == (bit // 8, 7 - bit % 8)


def test_neighbouring_signals_have_different_tones():
    for layout in subject_of().contract.layouts:
        tones = list(bits.tones(layout.signals).values())
        payload = [tone for tone in tones if tone != "h"]
        assert all(a != b for a, b in pairwise(payload)), layout.name


@pytest.mark.verifies(
    what="Interface control document: messages, signals, value tables, identifiers",
)
def test_the_map_shows_every_identifier_once():
    root = tree(8)
    marked = [int(e.get("data-id")) for e in root.iter() if e.get("data-id", "").isdigit()]
    assert sorted(marked) == sorted(m.frame_id for m in read_by_cantools(8).messages)
    kept = [e for e in tree(1).iter() if e.get("class") == "kept"]
    in_one = {m.frame_id for m in read_by_cantools(1).messages}
    in_eight = {m.frame_id for m in read_by_cantools(8).messages}
    assert len(kept) == len(in_eight - in_one)
