"""Forms and readers against the codec, kind by kind."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.contract.batch_codec import form, reader
from gnss_hil.dbc.contract.codec import codec, of_messages
from gnss_hil.dbc.contract.messages import HEADER_NAMES, MEASUREMENT_KINDS, Kind, Message, Signal

pytestmark = pytest.mark.verifies(
    "dbc/contract/batch_codec.py",
    what="Many kinds at once, both directions",
    by="the codec, which cantools judges, every kind and random mixes of kinds",
    status="validated",
)

CODEC = codec(4)
KINDS = tuple(CODEC.kinds)
SHARED = [MEASUREMENT_KINDS, ("TIME_MARK", "TIME_GPS", "TIME_FINE"), ("TAG", "STATUS"), ("ACK",),
          ("ALM_XY", "ALM_Z", "ALM_V"), ("ATT_Q01", "ATT_Q23", "ATT_RATE"), ("COMMAND",)]  # fmt: skip


def message(can_id, name, *signals):
    return Message(can_id, name, Kind(name, can_id, "A", ("B",), "", signals, protected=False), "A", ("B",))


OFFSETS = of_messages(
    [
        message(
            1, "ROOM",
            Signal("warm", 12, 0.5, -40, start=0), Signal("damp", 9, 0.25, 3, signed=True, start=12),
        ),
        message(2, "DOOR", Signal("width", 40, 0.001, start=3)),
    ],
    "", 1,
)  # fmt: skip

some_kinds = st.lists(st.sampled_from(KINDS), min_size=1, max_size=12)
seeds = st.integers(0, 2**32)


def generator(seed):
    return np.random.Generator(np.random.PCG64(seed))


def payload_of(tables, kind):
    return [name for name in tables.kinds[kind].signals if name not in HEADER_NAMES]


def limits(tables, kind, name):
    """Range of a signal [physical]."""
    layout = tables.kinds[kind]
    i = layout.signals.index(name)
    return (
        layout.raw_min[i] * layout.factor[i] + layout.offset[i],
        layout.raw_max[i] * layout.factor[i] + layout.offset[i],
    )


def assert_written_as_encoded(tables, kinds, n, random):
    """Every frame's own values, drawn from the whole range of each signal."""
    own = [
        {name: random.uniform(*limits(tables, kind, name), n) for name in payload_of(tables, kind)}
        for kind in kinds
    ]
    payloads, whole = form(tables, kinds).write(np.array([v for values in own for v in values.values()]))
    assert payloads.shape == (n, len(kinds), 8)
    assert whole.shape == (n, len(kinds))
    assert whole.all()
    for i, (kind, values) in enumerate(zip(kinds, own, strict=True)):
        assert payloads[:, i].tobytes() == tables.encode(kind, values, n).tobytes(), kind


def assert_read_as_decoded(tables, kinds, can_id, data):
    """All signals of `kinds`, and zeros for everything else."""
    paper = reader(tables, kinds)
    values = paper.read(can_id, data.view("<u8")[:, 0])
    for row, number in enumerate(tables.kind_of[can_id].tolist()):
        kind = tables.layouts[number].name if number >= 0 else ""
        signals = paper.signals.get(kind, ())
        decoded = tables.decode(kind, data[row : row + 1]) if signals else {}
        assert values[row].tolist() == [
            *(decoded[name][0] for name in signals),
            *[0.0] * (values.shape[1] - len(signals)),
        ]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=10, deadline=None)
@given(seed=seeds, n=st.integers(0, 5))
def test_writes_every_kind_as_the_codec_encodes_it(kind, seed, n):
    assert_written_as_encoded(CODEC, [kind], n, generator(seed))


@settings(max_examples=60, deadline=None)
@given(kinds=some_kinds, seed=seeds, n=st.integers(0, 5))
def test_writes_kinds_together_and_repeated_as_the_codec_encodes_them(kinds, seed, n):
    assert_written_as_encoded(CODEC, kinds, n, generator(seed))


@pytest.mark.parametrize("kinds", SHARED, ids=lambda kinds: kinds[0])
@settings(max_examples=30, deadline=None)
@given(seed=seeds, n=st.integers(0, 7))
def test_a_name_in_several_kinds_is_one_quantity(kinds, seed, n):
    paper, random = form(CODEC, kinds), generator(seed)
    holders = {name: [k for k in kinds if name in CODEC.kinds[k].signals] for name in paper.names}
    values = {}
    for name, holding in holders.items():
        low, high = zip(*(limits(CODEC, kind, name) for kind in holding), strict=True)
        values[name] = random.uniform(max(low), min(high), n)
    payloads, whole = paper.fill(n, values)
    assert whole.all()
    for i, kind in enumerate(kinds):
        own = {name: values[name] for name in payload_of(CODEC, kind)}
        assert payloads[:, i].tobytes() == CODEC.encode(kind, own, n).tobytes()


def test_a_scalar_fills_all_rows():
    payloads, _ = form(CODEC, ["TAG"]).fill(3, {"tag_offset_ns": np.array([1, -2, 3]), "clock_domain": 5})
    read = CODEC.decode("TAG", payloads[:, 0])
    assert read["tag_offset_ns"].tolist() == [1, -2, 3]
    assert read["clock_domain"].tolist() == [5, 5, 5]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("bad", "written"), [(np.nan, 0), (np.inf, 2**42 - 1), (-np.inf, 0), (5e8, 2**42 - 1), (-1.0, 0)]
)
def test_what_does_not_fit_saturates_and_marks_its_frame_and_no_other(bad, written):
    paper = form(CODEC, MEASUREMENT_KINDS)
    values = dict.fromkeys(paper.names, 0)
    values["pseudorange_m"] = np.array([2.1e7, bad, 2.2e7])
    payloads, whole = paper.fill(3, values)
    assert whole[:, 1:].all()
    assert whole[:, 0].tolist() == [True, False, True]
    read = CODEC.decode("RANGE", payloads[:, 0])["pseudorange_m"]
    assert read.tolist() == [2.1e7, written * 0.0001, 2.2e7]


@pytest.mark.parametrize("kind", KINDS)
def test_every_signal_saturates_alone(kind):
    """One signal far out of range ends at its own limit and leaves its neighbours as they were."""
    paper, layout = form(CODEC, [kind]), CODEC.kinds[kind]
    steps = dict(zip(layout.signals, layout.factor.tolist(), strict=True))
    for i, name in enumerate(layout.signals):
        if name in HEADER_NAMES:
            continue
        for far, raw in ((-1e30, layout.raw_min[i]), (1e30, layout.raw_max[i])):
            payloads, whole = paper.fill(1, steps | {name: far})
            assert whole.tolist() == [[False]]
            blank = dict.fromkeys(HEADER_NAMES & steps.keys(), 0)
            read = {signal: value[0] for signal, value in CODEC.decode(kind, payloads[:, 0]).items()}
            assert read == steps | blank | {name: raw * layout.factor[i]}


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_reads_every_kind_as_the_codec_decodes_it(kind, seed):
    """From every receiver or node that sends it."""
    can_id = np.array([i for (name, _), i in CODEC.can_id_of.items() if name == kind], np.uint32)
    data = generator(seed).integers(0, 256, (len(can_id), 8), np.uint8)
    assert_read_as_decoded(CODEC, [kind], can_id, data)


@settings(max_examples=60, deadline=None)
@given(kinds=some_kinds, seed=seeds, n=st.integers(0, 20))
def test_reads_a_mixed_block_as_the_codec_decodes_it(kinds, seed, n):
    """Identifiers of other kinds and of no kind among them."""
    random = generator(seed)
    can_id = random.choice([*CODEC.can_id_of.values(), 0, 0x3FF, 0x7FF], n).astype(np.uint32)
    assert_read_as_decoded(CODEC, kinds, can_id, random.integers(0, 256, (n, 8), np.uint8))


@settings(max_examples=30, deadline=None)
@given(seed=seeds, n=st.integers(1, 5))
def test_offsets_are_respected(seed, n):
    """No signal of the contract has one today; the codec knows them, so forms and readers do."""
    random = generator(seed)
    assert_written_as_encoded(OFFSETS, ["ROOM", "DOOR"], n, random)
    can_id = random.integers(1, 4, n).astype(np.uint32)
    assert_read_as_decoded(OFFSETS, ["ROOM", "DOOR"], can_id, random.integers(0, 256, (n, 8), np.uint8))
