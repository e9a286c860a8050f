"""The codec against cantools, the authority for the layout."""

from __future__ import annotations

import numpy as np
import pytest
from cantools.database import load_string
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.contract.codec import CodecError, codec
from gnss_hil.dbc.contract.messages import MAX_RECEIVERS

CODEC = codec(4)
CANTOOLS = load_string(CODEC.text, "dbc")


@pytest.mark.parametrize("message", CANTOOLS.messages, ids=lambda m: m.name)
@given(payloads=st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=5))
@settings(max_examples=15)
def test_decodes_as_cantools_does(message, payloads):
    kind = CODEC.layouts[CODEC.kind_of[message.frame_id]].name
    ours = CODEC.decode(kind, np.frombuffer(b"".join(payloads), np.uint8).reshape(-1, 8))
    for row, payload in enumerate(payloads):
        for name, value in message.decode(payload, decode_choices=False).items():
            assert ours[name][row] == value, f"{message.name}.{name}"


@pytest.mark.parametrize("message", CANTOOLS.messages, ids=lambda m: m.name)
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
