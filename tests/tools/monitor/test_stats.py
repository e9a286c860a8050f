"""What the monitor makes of frames: values, checks, counts, choices. cantools is the judge of values."""

from __future__ import annotations

from fnmatch import fnmatchcase

import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG, FrameBatch, batch, concat
from gnss_hil.dbc.contract.messages import HEADER_NAMES
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.live.screen import plain, width_of
from gnss_hil.tools.monitor import table
from gnss_hil.tools.monitor.filter import FrameFilter
from gnss_hil.tools.monitor.format import Formatter, identifier
from gnss_hil.tools.monitor.lines import Decoded, Piece
from gnss_hil.tools.monitor.stats import BusStats
from tests.support.live_runs import EPOCHS, epochs
from tests.support.lockstep_frames import heartbeat, mark

pytestmark = pytest.mark.verifies(
    "tools/monitor/stats.py",
    what="Monitor: counts, rates, ages",
    by="the project's own checks, all frames at once; times of the wall clock by hand",
    status="modelled",
)

CODEC = codec(4)
FORMATTER = Formatter(CODEC)
DATABASE = cantools.database.load_string(CODEC.text, database_format="dbc")
EVERYTHING = FrameFilter(CODEC, FORMATTER, [])
UNREADABLE_ONES = concat(
    (
        batch([0x7AB], b"\x01\x02\x03\x04\x05\x06\x07\x08"),
        batch([0x100], b"\x01\x02"),
        batch([0x101 | RTR_FLAG], b"", length=8),
        batch([0x1ABCDEF0 | EFF_FLAG], b"abc"),
        batch([0x0000_0004 | ERR_FLAG], b"\x00\x01\x00\x00\x00\x00\x00\x00"),
    )
)


def heard(*blocks: FrameBatch) -> BusStats:
    stats = BusStats(CODEC)
    for second, block in enumerate(blocks):
        stats.hear(block, float(second))
    return stats


@pytest.mark.verifies(
    "tools/monitor/format.py",
    what="Monitor's values",
    by="cantools, every frame of a real epoch",
    status="validated",
)
def test_values_are_what_cantools_says():
    block = epochs()[0][-1]
    texts = FORMATTER.values(block, np.zeros(len(block), np.uint8))
    for can_id, data, text in zip(block.can_id.tolist(), block.data, texts, strict=True):
        message = DATABASE.get_message_by_frame_id(can_id)
        decoded = message.decode(data.tobytes(), allow_truncated=False)
        shown = dict(part.split("=") for part in text.split())
        assert FORMATTER.name(can_id) == message.name
        assert list(shown) == [s for s in [s.name for s in message.signals] if s not in HEADER_NAMES]
        for signal in message.signals:
            if signal.name not in HEADER_NAMES:
                value = decoded[signal.name]
                if signal.name == "contract_hash":
                    assert int(shown[signal.name], 16) == value
                elif isinstance(value, (int, float)):
                    assert float(shown[signal.name]) == pytest.approx(value, abs=float(signal.scale) * 0.01)
                else:
                    assert shown[signal.name] == str(value)


def test_counts_are_those_of_the_protection():
    blocks = list(epochs()[0])
    data = blocks[70].data.copy()
    data[20, 6] ^= 1
    blocks[70] = FrameBatch(blocks[70].t_ns, blocks[70].can_id, blocks[70].length, data)
    blocks[71] = concat((blocks[71], blocks[71][30:31], UNREADABLE_ONES))
    stats = heard(*blocks)
    everything = concat(blocks)
    verdict = screening.screen(CODEC, everything, e2e.fresh_counters(CODEC)).verdict
    expected = {Verdict(v): int(n) for v, n in enumerate(np.bincount(verdict)) if v and n}
    assert stats.faults() == expected and expected[Verdict.CORRUPTED] == 1
    assert stats.frames == len(everything)
    base = [i for i in stats.heard if i < 2048]
    ids, counts = np.unique(everything.can_id[everything.can_id < 2048], return_counts=True)
    assert base == ids.tolist()
    assert stats.counts[base].sum(axis=1).tolist() == counts.tolist()


def test_rates_and_ages_are_by_the_wall_clock():
    stats = BusStats(CODEC)
    can_id = CODEC.can_id_of["TIME_MARK", 0]
    for tick in range(40):
        stats.hear(epochs()[0][tick], tick / 4)
        rate = stats.rates_hz(tick / 4)[can_id]
    assert rate == pytest.approx(4.0)
    assert stats.last_s[can_id] == 39 / 4


def test_a_waiting_nodes_repeated_heartbeat_is_no_fault():
    stats = heard(heartbeat(), heartbeat(), concat((heartbeat(), heartbeat())))
    assert stats.faults() == {} and stats.frames == 4


def test_a_repeated_heartbeat_of_a_running_node_is_one():
    frames, _ = e2e.protect(CODEC, concat((heartbeat(), heartbeat())), e2e.fresh_counters(CODEC), 0)
    stats = heard(frames, frames[1:])
    assert stats.faults() == {Verdict.REPEATED: 1}


def test_another_session_starts_its_counters_anew():
    """An emulator started again is no fault; the same mark twice in one session is."""
    assert heard(mark(5, session=1), mark(0, session=2)).faults() == {}
    assert heard(concat((mark(5, session=1), mark(0, session=2)))).faults() == {}
    assert heard(mark(5, session=1), mark(5, session=1)).faults() == {Verdict.REPEATED: 1}


def test_the_end_of_a_run_is_noticed_and_a_new_one_too():
    end = messages.encode(messages.END_ID, 1, 10, 0)
    assert not heard(mark(0)).ended
    assert heard(mark(0), end).ended
    assert not heard(mark(0), concat((end, mark(1, session=9)))).ended


def test_a_flood_of_strange_identifiers_is_bounded():
    strangers = batch(np.arange(5000) + 0x10000 | EFF_FLAG, np.zeros((5000, 8), np.uint8))
    stats = heard(strangers)
    assert stats.frames == 5000 and len(stats.heard) == 256 and stats.unlisted == 5000 - 256


def test_what_is_no_frame_of_the_contract_is_shown_as_such():
    piece = Piece(1_351_642_484_000_111, UNREADABLE_ONES, heard().hear(UNREADABLE_ONES, 0.0))
    assert Decoded(FORMATTER)(piece).decode().splitlines() == [
        "(1351642484.000111) 7AB ? 01 02 03 04 05 06 07 08 [UNKNOWN_ID]",
        "(1351642484.000111) 100 RX1_RANGE 01 02 [WRONG_LENGTH]",
        "(1351642484.000111) 101 ? remote, length 8 [REMOTE]",
        "(1351642484.000111) 1ABCDEF0 ? 61 62 63 [EXTENDED]",
        "(1351642484.000111) 20000004 ? 00 01 00 00 00 00 00 00 [ERROR_FRAME]",
    ]


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.integers(0, 8), st.binary(min_size=8, max_size=8))))
def test_no_frame_raises(frames):
    heap = concat(batch([can_id], data[:length], length=length) for can_id, length, data in frames)
    stats = BusStats(CODEC)
    verdict = stats.hear(heap, 0.0)
    text = Decoded(FORMATTER)(Piece(0, heap, verdict)).decode()
    assert len(text.splitlines()) == len(frames) == stats.frames
    assert table.screen(stats, EVERYTHING, FORMATTER, ["bus"], False, 1.0, (80, 24))
    assert table.totals(stats, EVERYTHING, FORMATTER, 1.0, 0, 0)


@pytest.mark.parametrize("raw", [False, True])
@pytest.mark.parametrize("size", [(80, 24), (60, 15), (200, 50), (120, 200), (30, 4), (5, 1)])
def test_a_table_fits_its_window(size, raw):
    stats = heard(*epochs()[0], UNREADABLE_ONES)
    lines = table.screen(stats, EVERYTHING, FORMATTER, ["socketcan:vcan0", "3 s"], raw, float(EPOCHS), size)
    assert 0 < len(lines) <= size[1] and max(map(width_of, lines)) <= size[0]
    texts = [plain(spans) for spans in lines]
    if size == (120, 200):
        assert not any("more identifiers" in text for text in texts)
        assert [text.split()[0] for text in texts[3:]] == [
            identifier(int(stats.can_id[r])) for r in stats.heard
        ]
    if size == (80, 24):
        assert sum("more identifiers" in text for text in texts) == 1 and len(texts) == 24


def ids_of(*patterns: str) -> set[int]:
    ids = np.arange(2048, dtype=np.uint32)
    return set(ids[FrameFilter(CODEC, FORMATTER, patterns).of(ids)].tolist())


@pytest.mark.verifies(
    "tools/monitor/filter.py",
    what="Monitor: what is chosen by message, kind, sender",
    by="names and senders as cantools reads them",
    status="validated",
)
@pytest.mark.parametrize(
    ("pattern", "wanted"),
    [
        ("RX1_RANGE", lambda m: m.name == "RX1_RANGE"),
        ("rx1_*", lambda m: fnmatchcase(m.name, "RX1_*")),
        ("NAV_*", lambda m: m.name.startswith("NAV_")),
        ("RANGE", lambda m: m.name.endswith("_RANGE")),
        ("FLIGHT", lambda m: m.senders == ["FLIGHT"]),
        ("0x100-0x10F", lambda m: 0x100 <= m.frame_id <= 0x10F),
    ],
)
def test_a_choice_is_by_message_kind_sender_or_identifier(pattern, wanted):
    found = {m.frame_id for m in DATABASE.messages if wanted(m)}
    assert found and found == {i for i in ids_of(pattern) if i in WORDS_KNOWN}


WORDS_KNOWN = {m.frame_id for m in DATABASE.messages}


def test_choices_add_up_and_all_is_the_default():
    assert ids_of("NAV_X,NAV_Y", "0x7E0") == {0x041, 0x042, 0x7E0}
    assert len(ids_of()) == 2048
    assert EVERYTHING.of(UNREADABLE_ONES.can_id).all()
    assert FrameFilter(CODEC, FORMATTER, ["0x1ABCDEF0"]).of(UNREADABLE_ONES.can_id).tolist() == [
        False
    ] * 3 + [
        True,
        False,
    ]


@pytest.mark.parametrize(
    ("pattern", "says"),
    [
        ("RX1_RNAGE", "did you mean 'RX1_RANGE'"),
        ("zzz", "for example RX1_RANGE"),
        ("0x20-0x10", "identifiers go up"),
        ("0xFFFFFFFF", "0x1FFFFFFF at most"),
        ("", "for example"),
    ],
)
def test_a_choice_of_nothing_is_a_mistake(pattern, says):
    with pytest.raises(Mistake, match=says.replace("(", r"\(")) as raised:
        FrameFilter(CODEC, FORMATTER, [pattern])
    assert "\n" not in str(raised.value)


def test_contract_hashes_are_shown_as_everywhere_in_hex():
    """As `gnss-hil icd hash` and the message of a node that speaks another."""
    from gnss_hil.dbc.contract import codec
    from gnss_hil.flightsw.io.encode import NodeState, heartbeat
    from gnss_hil.tools.monitor.format import Formatter

    four = codec.codec(4)
    (text,) = Formatter(four).values(heartbeat(four, NodeState.READY, 0, 0), np.zeros(1, np.uint8))
    assert f"contract_hash={four.hash:08x}" in text
