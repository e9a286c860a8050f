"""Forms and readers against cantools, and against the codec: rounding, limits, records of several kinds."""

from __future__ import annotations

import numpy as np
import pytest
from cantools.database import load_string
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.contract.batch_codec import form, joined, reader
from gnss_hil.dbc.contract.codec import codec, of_messages
from gnss_hil.dbc.contract.layout import Kind, Signal
from gnss_hil.dbc.contract.messages import HEADER_NAMES, MEASUREMENT_KINDS, Message

pytestmark = pytest.mark.verifies(
    "dbc/contract/batch_codec.py",
    what="Many kinds at once, both directions",
    by="cantools, every kind, both directions; mixes of kinds, limits and rounding by the codec",
    status="validated",
)

CODEC = codec(4)
CANTOOLS = load_string(CODEC.text, "dbc")
KINDS = tuple(CODEC.kinds)
SHARED = [MEASUREMENT_KINDS, ("TIME_MARK", "TIME_GPS", "TIME_FINE"), ("TAG", "STATUS"), ("ACK",),
          ("ALM_XY", "ALM_Z", "ALM_V"), ("ATT_Q01", "ATT_Q23", "ATT_RATE"), ("COMMAND",)]  # fmt: skip


def message(can_id, name, *signals):
    return Message(can_id, name, Kind(name, can_id, "A", ("B",), "", signals), "A", ("B",))


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


def names_of(tables, kinds):
    return list(dict.fromkeys(name for kind in kinds for name in payload_of(tables, kind)))


def assert_read_as_decoded(tables, kinds, n, random):
    """n records of one frame of each kind: all signals, each from the last frame that has it."""
    data = random.integers(0, 256, (len(kinds), n, 8), np.uint8)
    template = reader(tables, kinds, names_of(tables, kinds))
    values = template.read(data.view("<u8")[..., 0].take(template.frame, axis=0))
    decoded = {}
    for kind, frames in zip(kinds, data, strict=True):
        decoded |= tables.decode(kind, frames)
    assert values.shape == (len(template.names), n)
    for name, row in zip(template.names, values, strict=True):
        assert row.tolist() == decoded[name].tolist(), name
    return template, data.view("<u8")[..., 0], values


def message_of(kind):
    """cantools' message of the first identifier of a kind; and its signals without the header's."""
    first = min(can_id for (name, _), can_id in CODEC.can_id_of.items() if name == kind)
    found = CANTOOLS.get_message_by_frame_id(first)
    return found, [signal for signal in found.signals if signal.name not in HEADER_NAMES]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_writes_every_kind_as_cantools_does(kind, seed):
    """Any raw value of each signal, times its step; the protection header is blank."""
    random, (theirs, signals) = generator(seed), message_of(kind)
    values = dict.fromkeys(HEADER_NAMES & {signal.name for signal in theirs.signals}, 0)
    for signal in signals:
        low, high = (
            (-(1 << signal.length - 1), 1 << signal.length - 1)
            if signal.is_signed
            else (0, 1 << signal.length)
        )
        values[signal.name] = int(random.integers(low, high)) * signal.scale
    payloads, whole = form(CODEC, [kind]).fill(1, {signal.name: values[signal.name] for signal in signals})
    assert whole.all()
    assert payloads[0, 0].tobytes() == theirs.encode(values, strict=False)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_reads_every_kind_as_cantools_does(kind, seed):
    """Random payloads."""
    data, (theirs, signals) = generator(seed).integers(0, 256, (1, 8), np.uint8), message_of(kind)
    template = reader(CODEC, [kind], [signal.name for signal in signals])
    values = template.read(data.view("<u8")[:, :1].take(template.frame, axis=0))
    wanted = theirs.decode(data.tobytes(), decode_choices=False)
    assert dict(zip(template.names, values[:, 0].tolist(), strict=True)) == {
        s.name: wanted[s.name] for s in signals
    }


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
    template, random = form(CODEC, kinds), generator(seed)
    holders = {name: [k for k in kinds if name in CODEC.kinds[k].signals] for name in template.names}
    values = {}
    for name, holding in holders.items():
        low, high = zip(*(limits(CODEC, kind, name) for kind in holding), strict=True)
        values[name] = random.uniform(max(low), min(high), n)
    payloads, whole = template.fill(n, values)
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
    template = form(CODEC, MEASUREMENT_KINDS)
    values = dict.fromkeys(template.names, 0)
    values["pseudorange_m"] = np.array([2.1e7, bad, 2.2e7])
    payloads, whole = template.fill(3, values)
    assert whole[:, 1:].all()
    assert whole[:, 0].tolist() == [True, False, True]
    read = CODEC.decode("RANGE", payloads[:, 0])["pseudorange_m"]
    assert read.tolist() == [2.1e7, written * 0.0001, 2.2e7]


@pytest.mark.parametrize("kind", KINDS)
def test_every_signal_saturates_alone(kind):
    """One signal far out of range ends at its own limit and leaves its neighbours as they were."""
    template, layout = form(CODEC, [kind]), CODEC.kinds[kind]
    steps = dict(zip(layout.signals, layout.factor.tolist(), strict=True))
    for i, name in enumerate(layout.signals):
        if name in HEADER_NAMES:
            continue
        for far, raw in ((-1e30, layout.raw_min[i]), (1e30, layout.raw_max[i])):
            payloads, whole = template.fill(1, steps | {name: far})
            assert whole.tolist() == [[False]]
            blank = dict.fromkeys(HEADER_NAMES & steps.keys(), 0)
            read = {signal: value[0] for signal, value in CODEC.decode(kind, payloads[:, 0]).items()}
            assert read == steps | blank | {name: raw * layout.factor[i]}


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=10, deadline=None)
@given(seed=seeds, n=st.integers(0, 5))
def test_reads_every_kind_as_the_codec_decodes_it(kind, seed, n):
    assert_read_as_decoded(CODEC, [kind], n, generator(seed))


@settings(max_examples=60, deadline=None)
@given(kinds=some_kinds, seed=seeds, n=st.integers(0, 20))
def test_reads_records_of_several_frames_as_the_codec_decodes_them(kinds, seed, n):
    assert_read_as_decoded(CODEC, kinds, n, generator(seed))


@settings(max_examples=60, deadline=None)
@given(parts=st.lists(st.tuples(some_kinds, st.integers(0, 5)), min_size=1, max_size=5), seed=seeds)
def test_a_joined_reader_reads_what_its_parts_read(parts, seed):
    random = generator(seed)
    tables = [OFFSETS if i % 2 else CODEC for i in range(len(parts))]
    kinds = [["ROOM", "DOOR"] if i % 2 else kinds for i, (kinds, _) in enumerate(parts)]
    read = [
        assert_read_as_decoded(table, own, n, random)
        for table, own, (_, n) in zip(tables, kinds, parts, strict=True)
    ]
    whole = joined([(template, values.shape[1]) for template, _, values in read])
    words = np.concatenate([words.take(template.frame, axis=0).ravel() for template, words, _ in read])
    assert whole.read(words).tolist() == [v for _, _, values in read for v in values.ravel().tolist()]
    assert whole.names == tuple(name for template, _, _ in read for name in template.names)


@settings(max_examples=30, deadline=None)
@given(seed=seeds, n=st.integers(1, 5))
def test_offsets_are_respected(seed, n):
    """No signal of the contract has one today; the codec knows them, so forms and readers do."""
    random = generator(seed)
    assert_written_as_encoded(OFFSETS, ["ROOM", "DOOR"], n, random)
    assert_read_as_decoded(OFFSETS, ["ROOM", "DOOR"], n, random)
