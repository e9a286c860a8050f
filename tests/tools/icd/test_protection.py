"""Worked examples: an independent implementation of the profile, and the published test vectors, agree."""

from __future__ import annotations

import re

import e2e.p11
import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.tools.icd import prose, protection
from gnss_hil.tools.icd.protection import VECTORS, crc_steps
from tests.support.icd_pages import tree, words

CODEC = codec(4)
EXAMPLES = [e for e in tree().iter("table") if e.get("class") == "crc"]


@pytest.mark.parametrize("table", EXAMPLES, ids=lambda table: table.get("data-id"))
def test_the_crc_drawn_step_by_step_is_that_of_autosar_e2e(table):
    payload, data_id = bytes.fromhex(table.get("data-payload")), int(table.get("data-id"), 16)
    theirs = bytearray(payload)
    e2e.p11.e2e_p11_protect(theirs, data_id, increment_counter=False)
    rows = [[words(cell) for cell in tr.iter("td")] for tr in table.iter("tr")][1:]
    assert [int(row[1], 16) for row in rows] == [data_id & 0xFF, data_id >> 8, *payload[1:]]
    assert all(int(row[3], 16) == int(row[1], 16) ^ int(row[2], 16) for row in rows)
    assert [row[2] for row in rows] == ["00", *(row[4] for row in rows[:-1])]
    assert int(rows[-1][4], 16) == theirs[0] == payload[0]


def test_the_examples_are_the_published_vectors():
    published = re.findall(r"\| `(0x\w+)` \| [^|]*\| 37 \| `([0-9A-F ]+)` \|", prose.sections()["Protection"])
    assert len(published) == len(VECTORS) == len(EXAMPLES)
    assert [(e.get("data-id"), e.get("data-payload")) for e in EXAMPLES] == published


@pytest.mark.parametrize(("counter", "expected"), [(0, 0xCC), (1, 0x91)])
def test_steps_give_autosars_published_example(counter, expected):
    """AUTOSAR PRS E2E Protocol, Profile 11 variant A, data id 0x123, eight zero bytes."""
    *_, last = crc_steps(0x123, bytes([0, counter, 0, 0, 0, 0, 0, 0]))
    assert last.after == expected


def test_the_printed_table_is_the_crc_of_each_byte():
    """Bit by bit from the polynomial, as SAE J1850 has it."""

    def bitwise(value: int) -> int:
        for _ in range(8):
            value = (value << 1 ^ 0x1D if value & 0x80 else value << 1) & 0xFF
        return value

    (table,) = [e for e in tree().iter("table") if e.get("class") == "hex"]
    cells = [words(cell) for tr in table.iter("tr") for cell in list(tr.iter("td"))[1:]]
    assert [int(cell, 16) for cell in cells] == [bitwise(k) for k in range(256)]


def test_counter_states_are_those_of_the_contracts_table():
    (table,) = [e for e in tree().iter("table") if e.get("class") == "advances"]
    rows = [[words(cell) for cell in tr.iter("td")] for tr in table.iter("tr")][1:]
    assert [row[:3] for row in rows] == [
        ["0", "repeated", "no"],
        ["1", "ok", "yes"],
        ["2 to 3", "lost", "yes"],
        ["4 to 14", "wrong sequence", "no"],
    ]


def test_every_reason_has_its_consequence():
    from gnss_hil.dbc.contract.screening import Verdict
    from gnss_hil.flightsw.io.frame_statistics import Reason

    (table,) = [e for e in tree().iter("table") if e.get("class") == "reasons"]
    listed = [words(tr[0]) for tr in table.iter("tr")][1:]
    assert sorted(listed) == sorted(
        protection.in_words(r.name) for r in (*Verdict, *Reason) if r != Verdict.OK
    )


def test_later_frames_keep_counting():
    """After epoch 37, counter 0: fourteen epochs on it is 14, then 0 again, while the nibble goes its way."""
    shown = words(tree())
    assert "51 3 14" in shown
    assert "52 4 0" in shown


def test_a_contract_of_one_receiver_has_the_examples_it_can_have():
    assert len([e for e in tree(1).iter("table") if e.get("class") == "crc"]) == len(VECTORS) - 1
