"""The documents of the contract say what the contract is."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.common import systems
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.e2e import fresh_counters, protect
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.emulator.error_models.registry import FACTORS

DOCS = Path(__file__).parents[2] / "docs"
CODEC = codec(4)

VECTORS = {
    "RX1_RANGE": ("RANGE", 1, {"channel": 3, "pseudorange_m": 21345678.9012}),
    "RX1_SV_CLOCK": (
        "SV_CLOCK",
        1,
        {"channel": 3, "sat_system": 1, "sat_number": 21, "clock_m": -12345.678},
    ),
    "RX2_COMMAND": ("COMMAND", 2, {"channel": 5, "action": 1, "sat_number": 7, "transaction": 291}),
    "ATT_Q01": ("ATT_Q01", 0, {"q0": 0.5, "q1": -0.5}),
}


@pytest.mark.parametrize("name", VECTORS)
def test_published_vectors(name):
    row = re.search(
        rf"\| `(0x\w+)` \| {name}: .*?\| 37 \| `([0-9A-F ]+)` \|", (DOCS / "contract.md").read_text("utf-8")
    )
    kind, number, values = VECTORS[name]
    can_id = CODEC.can_id_of[kind, number]
    frames, _ = protect(CODEC, batch(can_id, CODEC.encode(kind, values)), fresh_counters(CODEC), 37)
    assert int(row[1], 16) == can_id
    assert bytes.fromhex(row[2]) == np.asarray(frames.data).tobytes()


def test_every_error_model_is_in_the_table_of_factors():
    table = re.findall(r"^\|.*\|$", (DOCS / "factors.md").read_text("utf-8").split("## ")[0], re.M)
    named = set(re.findall(r"`(\w+)`", "".join(table)))
    assert FACTORS.keys() <= named


def test_what_a_satellite_system_takes_is_said_alike():
    """In the table of systems, where one begins, and among ARCHITECTURE's additions."""
    (row,) = re.findall(
        r"^\| a satellite system \|.*$", (DOCS.parent / "ARCHITECTURE.md").read_text("utf-8"), re.M
    )
    said, again = (
        [
            place
            for place in re.findall(r"`([\w/.]+)`", text)
            if place.startswith(("dbc/", "emulator/", "tools/"))
        ]
        for text in (row, systems.__doc__)
    )
    assert said == again
    assert f"| {said.index('emulator/constellation/nominal.py') + 1} and a test" in row
    assert f"{len(said) - 5} more" in row
    for place in said:
        assert "NAME" in place or (DOCS.parent / place).exists(), place
