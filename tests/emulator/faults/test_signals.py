"""Changes of signals, read back by cantools; CRCs by AUTOSAR's library."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.dbc.contract.messages import HEADER_NAMES, messages
from gnss_hil.emulator.faults import engine, files, signals
from gnss_hil.emulator.faults.base import At, Direction
from gnss_hil.emulator.faults.models import FaultError
from gnss_hil.emulator.faults.signals import Change
from tests.support.faulted import (
    CODEC,
    DATABASE,
    NS,
    VEHICLE,
    all_sound,
    by_cantools,
    of_kind,
    plan_of,
    strike,
)

pytestmark = pytest.mark.verifies(
    "emulator/faults/signals.py",
    "emulator/faults/alter.py",
    "emulator/faults/kinds/content.py",
    what="Faults: signals, bits and lengths",
    by="cantools reads what was changed, to half a step; autosar-e2e finds the CRC valid; bits counted",
    status="validated",
)

CHANGED = [
    (m.name, s.name) for m in messages(4) for s in m.kind.signals
    if s.name not in HEADER_NAMES and s.name != m.kind.key and not m.kind.name.startswith("BENCH")
]  # fmt: skip


def altered(name: str, payload: bytes, change: str):
    """A protected frame of a message before and after a change, as cantools has them; its data."""
    message = DATABASE.get_message_by_name(name)
    frame, _ = e2e.protect(CODEC, batch(message.frame_id, payload), e2e.fresh_counters(CODEC), 0)
    plan = plan_of(f"{name} {name}.{change}")
    way = Direction.RECEIVERS if "FLIGHT" in message.senders else Direction.FLIGHT
    _, out, _ = engine.inject(plan, engine.fresh(plan), frame, At(0, 0, way))
    return by_cantools(frame)[0], by_cantools(out)[0], out


@settings(max_examples=200, deadline=None)
@given(which=st.sampled_from(CHANGED), payload=st.binary(min_size=8, max_size=8), share=st.floats(0, 1))
def test_a_value_is_what_cantools_reads_and_nothing_else_changes(which, payload, share):
    name, signal = which
    found = next(s for s in DATABASE.get_message_by_name(name).signals if s.name == signal)
    top = 2 ** (found.length - found.is_signed)
    low, high = (raw * found.scale + found.offset for raw in ((-top if found.is_signed else 0), top - 1))
    value = low + share * (high - low)
    before, after, out = altered(name, payload, f"{signal} = {value!r}")
    assert after[signal] == pytest.approx(value, abs=0.501 * found.scale)
    assert {k: v for k, v in after.items() if k not in (signal, "e2e_crc")} == {
        k: v for k, v in before.items() if k not in (signal, "e2e_crc")
    }
    assert all_sound(out)


def test_what_a_signal_cannot_carry_is_the_nearest_that_it_can():
    _, after, _ = altered("RX1_RATE", bytes(8), "cn0_dbhz += 63.75")
    assert after["cn0_dbhz"] == 63.75
    _, after, _ = altered("RX1_RATE", b"\xff" * 8, "cn0_dbhz += 1")
    assert after["cn0_dbhz"] == 63.75
    _, after, _ = altered("RX1_RANGE", bytes(8), "pseudorange_m -= 5")
    assert after["pseudorange_m"] == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ATT_Q01.q0 = 5", "signal ATT_Q01.q0 carries -1.048576 to 1.048575875, found 5"),
        ("ATT_Q01.q0 = -1.049", "found -1.049"),
        ("cn0_dbhz = 64", "signal RATE.cn0_dbhz carries 0 to 63.75, found 64"),
        ("RANGE.pseudorange_m -= 1e9", "an offset of -1000000000 leads out of that from anywhere"),
        ("RANGE.pseudorange_m += 0", "that changes nothing"),
        ("RANGE.pseudorange_m *= 1", "that changes nothing"),
        ("RANGE.pseudorange_m += 0/s", "that changes nothing"),
    ],
)
def test_what_no_signal_can_carry_is_refused(text, words):
    with pytest.raises(ValueError) as caught:
        Change.model_validate(text)
    assert words in str(caught.value)


def test_the_ends_of_a_signal_are_carried():
    for text in (
        "ATT_Q01.q0 = -1.048576",
        "ATT_Q01.q0 = 1.048575875",
        "RATE.cn0_dbhz = 63.75",
        "NAV_X.x_m = 1e8",
    ):
        assert Change.model_validate(text)


def test_a_signal_of_several_messages_has_the_limits_of_those_at_the_place():
    table = {"kind": "masquerade", "on": "rx1", "change": {"signal": "x_m", "value": 1e8}}
    given = files.FILES.checked({"fault": [table, {**table, "on": "FLIGHT"}]}, "x").fault
    with pytest.raises(FaultError, match=r"signal \w+\.x_m carries .* found 100000000$") as caught:
        engine.armed(given, "soyuz", VEHICLE, CODEC, NS, 1)
    assert len(str(caught.value).splitlines()) == 1


def readings(line: str, kind: str, signal: str) -> list[tuple[list[float], list[float]]]:
    """A signal of a kind in the epochs 99 to 104, before and behind a fault."""
    return [
        tuple(
            [row[signal] for row in by_cantools(of_kind(frames, kind))] for frames in (one.before, one.block)
        )
        for one in strike(line)[99:105]
    ]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("+= 30", lambda x, k: x + 30),
        ("-= 2.5", lambda x, k: x - 2.5),
        ("*= 1.001", lambda x, k: x * 1.001),
        ("+= 2/s", lambda x, k: x + 2 * k),
    ],
)
def test_offset_scale_and_drift(change, expected):
    for k, (before, after) in enumerate(
        readings(f"RANGE.pseudorange_m {change} @100+4", "RANGE", "pseudorange_m"), -1
    ):
        wanted = [expected(x, k) for x in before] if 0 <= k < 4 else before
        assert after == pytest.approx(wanted, abs=1e-4)


@pytest.mark.parametrize(
    ("line", "kind", "beyond"),
    [
        ("rx1 RANGE.pseudorange_m *= 1000 @100+2", "RANGE", True),
        ("rx1 RANGE.pseudorange_m -= 1e8/s @99+3", "RANGE", True),
        ("rx1 RANGE.pseudorange_m += 30 @100+2", "RANGE", False),
        ("rx1 range -1e8 m carrier=false @100+2", "RANGE", True),
        ("rx1 range 30 m @100+2", "RANGE", False),
        ("rx1 gps SV_X bad-ephemeris radial_m=30 @100+2", "SV_X", False),
    ],
)
def test_values_that_no_bits_can_carry_are_counted(line, kind, beyond):
    for one in strike(line)[100:102]:
        rows = of_kind(one.before, kind)
        mine = int((CODEC.number_of[rows.can_id] == 1).sum())
        assert mine and sum(event.clipped for event in one.events) == (mine if beyond else 0)


def test_coordinates_beyond_their_bits_are_counted():
    for one in strike("gps bad-ephemeris radial_m=1e8 along_m=1e8 @100+2")[100:102]:
        after = [row["x_m"] for row in by_cantools(of_kind(one.block, "SV_X"))]
        after += [row["y_m"] for row in by_cantools(of_kind(one.block, "SV_Y"))]
        after += [row["z_m"] for row in by_cantools(of_kind(one.block, "SV_Z"))]
        ends = sum(abs(value) > 109_951_162.7 for value in after)
        assert ends and sum(event.clipped for event in one.events) == ends


def test_freeze_and_random():
    frozen = readings("ATT ATT_Q01.q0 freeze @100+4", "ATT_Q01", "q0")
    assert [after for _, after in frozen[1:5]] == [frozen[1][0]] * 4
    assert frozen[0][0] == frozen[0][1] and frozen[5][0] == frozen[5][1]
    drawn = [after[0] for _, after in readings("ATT ATT_Q01.q0 random @100+4", "ATT_Q01", "q0")[1:5]]
    assert len(set(drawn)) == 4 and max(map(abs, drawn)) <= 1.05


def test_what_freezes_is_held_for_a_window_and_no_longer():
    held = readings("ATT ATT_Q01.q0 freeze @100 every=3 on=2", "ATT_Q01", "q0")
    before = [one for one, _ in held]
    assert [after for _, after in held[1:]] == [before[k] for k in (1, 1, 3, 4, 4)]


def test_a_label_stands_for_its_number():
    for _, after in readings("SV_Z.health = UNHEALTHY @100+4", "SV_Z", "health")[1:5]:
        assert after == [1] * len(after)


def test_stuck_keeps_the_payload_and_lives_in_the_header():
    struck = strike("rx2 receiver-stuck @100+4")
    blocks = [of_kind(struck[k].block, "RANGE") for k in range(100, 104)]
    mine = [rows[CODEC.number_of[rows.can_id] == 2] for rows in blocks]
    assert all((rows.data[:, 2:] == mine[0].data[:, 2:]).all() for rows in mine)
    headers = [by_cantools(rows)[0] for rows in mine]
    counters = [row["e2e_counter"] for row in headers]
    assert [(b - a) % 15 for a, b in pairwise(counters)] == [1, 1, 1]
    assert all(map(all_sound, mine))


@pytest.mark.parametrize("bits", [1, 2, 5, 64])
def test_so_many_bits_are_turned_over(bits):
    one = strike(f"rx1 corruption {bits} @100+1")[100]
    changed = one.before.words ^ one.block.words
    counts = np.bitwise_count(changed)
    assert set(counts.tolist()) == {0, bits}
    assert (counts > 0).sum() == (CODEC.number_of[one.before.can_id] == 1).sum()


def test_bits_of_a_mask_are_turned_over():
    one = strike("rx1 corruption flip=0000800000000001 @100+1")[100]
    changed = (one.before.data ^ one.block.data)[CODEC.number_of[one.before.can_id] == 1]
    assert (changed == [0, 0, 0x80, 0, 0, 0, 0, 1]).all()


def test_a_shorter_frame_has_nothing_behind_its_end():
    one = strike("rx1 RANGE length 3 @100+1")[100]
    short = one.block[one.block.length != 8]
    assert set(short.length.tolist()) == {3} and len(short) == 6
    assert not short.data[:, 3:].any()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("RANGE.pseudorang_m += 3", "RANGE has no signal 'pseudorang_m'; did you mean 'pseudorange_m'?"),
        ("RANG.pseudorange_m += 3", "no message 'RANG'; did you mean 'RANGE'?"),
        ("RANGE.e2e_crc = 3", "signal RANGE.e2e_crc: CRC, counter and epoch are the protection's"),
        ("SV_Z.health = ILL", "signal SV_Z.health has no value 'ILL'"),
        ("SV_Z.health += UNHEALTHY", "a label goes with ="),
        ("RANGE.pseudorange_m = 3/s", "a rate goes with += or -="),
    ],
)  # fmt: skip
def test_changes_that_cannot_be(text, words):
    with pytest.raises(FaultError) as caught:
        files.of_line(f"rx1 {text}")
    assert words in str(caught.value)


@given(
    st.sampled_from(["RANGE.pseudorange_m", "cn0_dbhz", "RX2_RATE.lock"]),
    st.sampled_from(["value", "offset", "scale", "drift_per_s"]),
    st.floats(-1e6, 1e6),
)
def test_text_of_a_change_is_read_back(signal, way, number):
    number = abs(number) % 7 if way == "value" else number % 7 if way == "offset" else number
    assume(way == "value" or number != (1 if way == "scale" else 0))
    change = Change.model_validate({"signal": signal, way: number})
    assert Change.model_validate(signals.text(change)) == change
