"""The codec against cantools, the authority for the layout."""

from __future__ import annotations

import re

import numpy as np
import pytest
from cantools.database import load_string
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.codec import CodecError, codec
from gnss_hil.dbc.contract.messages import ATTITUDE_NODE, FLIGHT_NODE, TIME_NODE

pytestmark = pytest.mark.verifies(
    "dbc/contract/codec.py",
    what="DBC layout, both directions",
    by="cantools, every message, random payloads",
    status="validated",
)

CODEC = codec(4)
CANTOOLS = load_string(CODEC.text, "dbc")
KINDS = [m for m in CANTOOLS.messages if not re.match(r"RX[2-9]", m.name)]
"""Each kind of message once: other receivers' are laid out alike, which the tables' own test asks for."""


@pytest.mark.parametrize("message", KINDS, ids=lambda m: m.name)
@given(payloads=st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=5))
@settings(max_examples=15)
def test_decodes_as_cantools_does(message, payloads):
    kind = CODEC.layouts[CODEC.kind_of[message.frame_id]].name
    ours = CODEC.decode(kind, np.frombuffer(b"".join(payloads), np.uint8).reshape(-1, 8))
    for row, payload in enumerate(payloads):
        for name, value in message.decode(payload, decode_choices=False).items():
            assert ours[name][row] == value, f"{message.name}.{name}"


@pytest.mark.parametrize("message", KINDS, ids=lambda m: m.name)
@given(data=st.data())
@settings(max_examples=15)
def test_encodes_as_cantools_does(message, data):
    kind = CODEC.layouts[CODEC.kind_of[message.frame_id]].name
    values = {}
    for s in message.signals:
        low, high = (
            (-(1 << s.length - 1), (1 << s.length - 1) - 1) if s.is_signed else (0, (1 << s.length) - 1)
        )
        raw = data.draw(st.integers(low, high))
        values[s.name] = raw * s.scale
    ours = CODEC.encode(kind, {name: np.array([value]) for name, value in values.items()})
    assert bytes(ours[0]) == message.encode(values, strict=False)


def test_rounds_to_the_nearest_step():
    data = CODEC.encode("RANGE", {"pseudorange_m": np.array([21_000_000.00004, 21_000_000.00006])})
    assert CODEC.decode("RANGE", data)["pseudorange_m"] == pytest.approx([21e6, 21e6 + 0.0001], abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "values", "text"),
    [
        ("RANGE", {"pseudorange_m": 5e8}, r"RANGE.pseudorange_m = 5e\+08 does not fit; allowed 0 to 4\.39"),
        ("RANGE", {"pseudorange_m": np.nan}, "RANGE.pseudorange_m = nan"),
        ("RANGE", {"pseudorange_m": np.array([2e7, -1e-2])}, "RANGE.pseudorange_m = -0.01"),
        ("SV_X", {"x_m": -2e8}, r"SV_X.x_m = -2e\+08 does not fit; allowed -1.09951e\+08"),
        ("RATE", {"lock": 8}, "RATE.lock = 8 does not fit; allowed 0 to 7"),
        ("NAV_CORR", {"rho_xy": np.inf}, "NAV_CORR.rho_xy = inf"),
    ],
)
def test_refuses_what_a_signal_cannot_carry(kind, values, text):
    with pytest.raises(CodecError, match=text):
        CODEC.encode(kind, values)


HEARTBEATS = {"ATT_HEARTBEAT": ATTITUDE_NODE, "TIME_HEARTBEAT": TIME_NODE, "FLIGHT_HEARTBEAT": FLIGHT_NODE}


def kind_and_number(name):
    """Kind and receiver or node of a message, by its name in the DBC."""
    if name in HEARTBEATS:
        return "HEARTBEAT", HEARTBEATS[name]
    repeated = re.fullmatch(r"RX(\d)_(\w+)", name)
    return (repeated[2], int(repeated[1])) if repeated else (name, 0)


@pytest.mark.parametrize("receivers", range(1, MAX_RECEIVERS + 1))
def test_tables_are_what_cantools_reads_from_the_dbc(receivers):
    tables = codec(receivers)
    database = load_string(tables.text, "dbc", strict=True)
    known = np.zeros(len(tables.kind_of), bool)
    for message in database.messages:
        can_id = message.frame_id
        known[can_id] = True
        kind, number = kind_and_number(message.name)
        layout = tables.layouts[tables.kind_of[can_id]]
        assert (layout.name, tables.number_of[can_id]) == (kind, number)
        assert layout is tables.kinds[kind]
        assert tables.can_id_of[kind, number] == can_id
        assert tables.sender_of[can_id] == message.senders[0]
        attributes = {name: a.value for name, a in message.dbc.attributes.items()}
        assert attributes["E2EProfile"] == "P11A" and attributes["E2EDataID"] == can_id
        signals = sorted(message.signals, key=lambda s: s.start)
        key = next((s for s in signals if s.name == attributes.get("E2EStreamKey")), None)
        assert tables.key_shift_of[can_id] == layout.key_shift == (key.start if key else 0)
        assert tables.key_mask_of[can_id] == layout.key_mask == ((1 << key.length) - 1 if key else 0)
        assert all(s.byte_order == "little_endian" and not s.is_float for s in signals)
        assert layout.signals == tuple(s.name for s in signals)
        assert layout.shift.tolist() == [s.start for s in signals]
        assert layout.mask.tolist() == [(1 << s.length) - 1 for s in signals]
        assert layout.sign_bit.tolist() == [1 << s.length - 1 if s.is_signed else 0 for s in signals]
        assert layout.factor.tolist() == [s.scale for s in signals]
        assert layout.offset.tolist() == [s.offset for s in signals]
        assert layout.raw_min.tolist() == [-(1 << s.length - 1) if s.is_signed else 0 for s in signals]
        assert layout.raw_max.tolist() == [(1 << s.length - s.is_signed) - 1 for s in signals]
        assert layout.integral == tuple(s.scale == 1 and s.offset == 0 for s in signals)
    assert ((tables.kind_of >= 0) == known).all()
    assert len(tables.can_id_of) == len(database.messages)
    assert [layout.number for layout in tables.layouts] == list(range(len(tables.kinds)))


@pytest.mark.parametrize("receivers", range(1, MAX_RECEIVERS + 1))
def test_tables_know_every_receiver(receivers):
    sized = codec(receivers)
    for r in range(1, receivers + 1):
        can_id = sized.can_id_of["RANGE", r]
        assert sized.number_of[can_id] == r
        assert sized.sender_of[can_id] == f"RX{r}"
        assert sized.layouts[sized.kind_of[can_id]].name == "RANGE"
    assert (sized.kind_of >= 0).sum() == len(sized.can_id_of)


def test_contract_hash_is_the_first_word_of_sha256():
    import hashlib

    assert CODEC.hash == int(hashlib.sha256(CODEC.text.encode()).hexdigest()[:8], 16)
    assert len({codec(m).hash for m in range(1, 9)}) == 8
