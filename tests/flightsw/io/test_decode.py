"""What may and what may not enter an epoch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.e2e_state import limits
from gnss_hil.dbc.contract.frames import EFF_FLAG, EMPTY, ERR_FLAG, RTR_FLAG, FrameBatch, batch, concat
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.io.decode import admitted, decode
from gnss_hil.flightsw.io.frame_statistics import Reason, no_rejections, rejection_table
from gnss_hil.flightsw.io.reception import nothing_received
from tests.support import synthetic_epochs as s
from tests.support.fixes import craft
from tests.support.flown import CODEC, FakeBus, frames

pytestmark = [
    pytest.mark.verifies(
        "flightsw/io/decode.py",
        "flightsw/io/block_layout.py",
        "flightsw/io/frame_groups.py",
        "flightsw/records/epoch.py",
        "flightsw/io/frame_statistics.py",
        what="Decoding: what may enter a fix",
        by=(
            "no damage, loss, repetition or mixture that hypothesis finds gets through; values are the "
            "codec's, which cantools judges"
        ),
        status="validated",
    ),
    pytest.mark.verifies(
        "flightsw/io/node_monitor.py",
        what="Silent, foreign and restarted nodes",
        by="rules of docs/contract.md",
        status="modelled",
    ),
]

LIMITS = limits(Protection())


@pytest.fixture(scope="module")
def blocks():
    """Two consecutive blocks of 24 channels."""
    bus = FakeBus(craft(), s.constellation())
    return bus.block(0), bus.block(1)


def taken(*batches, received=None):
    """Epoch of the last batch, and counts by reason, after the batches one by one."""
    received = nothing_received(CODEC) if received is None else received
    rejected = no_rejections()
    for block in batches:
        epoch, received, rejected = decode(CODEC, LIMITS, block, received, rejected)
    return epoch, {reason: n for reason in range(len(rejected)) if (n := int(rejected[reason].sum()))}


def where(block, kind, number=0, channel=None):
    rows = np.flatnonzero(block.can_id == CODEC.can_id_of[kind, number])
    if channel is not None:
        rows = rows[block.data[rows, 2] & 31 == channel]
    return rows


def without(block, rows):
    return block[np.delete(np.arange(len(block)), rows)]


def changed(block, row, byte=4, by=0x10):
    data = block.data.copy()
    data[row, byte] ^= by
    return FrameBatch(block.t_ns, block.can_id, block.length, data)


def test_whole_epoch(blocks):
    epoch, rejected = taken(*blocks)
    assert rejected == {}
    assert (epoch.mark.session, epoch.mark.epoch, epoch.mark.t_ns) == (7, 1, s.T0_NS + 10**9)
    assert len(epoch.measurements) == 24
    assert len(epoch.almanac.sat) == 12
    assert epoch.domains.tolist() == [0, 0, 0, 0, -1, -1, -1, -1]
    assert epoch.boots.tolist() == [1, 1, 1, 1, -1, -1, -1, -1]


def test_values_equal_the_codecs(blocks):
    """The one-pass reader against the codec, kind by kind."""
    epoch, _ = taken(blocks[0])
    m = epoch.measurements
    for kind, names in {
        "RANGE": {"pseudorange_m": m.pseudorange_m, "channel": m.channel},
        "RATE": {"range_rate_mps": m.range_rate_mps, "cn0_dbhz": m.cn0_dbhz, "lock": m.lock,
                 "signal": m.signal},
        "SV_X": {"x_m": m.pos_sv_m[0]}, "SV_Y": {"y_m": m.pos_sv_m[1]},
        "SV_Z": {"z_m": m.pos_sv_m[2], "health": m.health},
        "SV_VX": {"vx_mps": m.vel_sv_mps[0], "clock_drift_mps": m.clock_drift_mps},
        "SV_VY": {"vy_mps": m.vel_sv_mps[1]},
        "SV_VZ": {"vz_mps": m.vel_sv_mps[2], "ura": m.ura, "frequency": m.frequency},
        "SV_CLOCK": {"clock_m": m.clock_m, "sat_number": m.sat % 64, "sat_system": m.sat // 64},
    }.items():  # fmt: skip
        rows = blocks[0][CODEC.kind_of[blocks[0].can_id] == CODEC.kinds[kind].number]
        decoded = CODEC.decode(kind, rows.data)
        for name, values in names.items():
            assert np.array_equal(decoded[name], values), (kind, name)


@pytest.mark.parametrize("kind", ["RANGE", "PHASE", "SV_Z", "SV_CLOCK"])
def test_lost_frame_takes_out_its_channel_only(blocks, kind):
    row = where(blocks[0], kind, 2, channel=3)
    epoch, rejected = taken(without(blocks[0], row))
    assert rejected == {Reason.INCOMPLETE: 9}
    left = set(zip(epoch.measurements.receiver.tolist(), epoch.measurements.channel.tolist(), strict=True))
    assert len(left) == 23 and (1, 3) not in left


def one_almanac_record(block, of_each_kind=(0, 0, 0)):
    """With one frame of each almanac kind: the first, or a later one."""
    rows = np.array([where(block, kind, 1) for kind in ("ALM_XY", "ALM_Z", "ALM_V")])
    return without(block, np.setdiff1d(rows, rows[range(3), of_each_kind]))


def test_an_almanac_record_by_itself_is_the_same_as_among_others(blocks):
    every, (epoch, rejected) = taken(blocks[0])[0].almanac, taken(one_almanac_record(blocks[0]))
    assert rejected == {} and len(epoch.almanac.sat) == 1
    same = every.sat == epoch.almanac.sat
    for name in ("pos_ecef_m", "vel_ecef_mps", "healthy"):
        assert np.array_equal(getattr(epoch.almanac, name), getattr(every, name)[..., same])


def test_almanac_frames_of_two_satellites_are_no_record(blocks):
    epoch, rejected = taken(one_almanac_record(blocks[0], (0, 1, 0)))
    assert rejected == {Reason.INCOMPLETE: 3} and not len(epoch.almanac.sat)


@pytest.mark.parametrize("byte", range(8))
def test_corrupted_frame_takes_out_its_channel_only(blocks, byte):
    row = where(blocks[0], "SV_X", 1, channel=0)[0]
    epoch, rejected = taken(changed(blocks[0], row, byte))
    assert rejected == {Verdict.CORRUPTED: 1, Reason.INCOMPLETE: 9}
    assert len(epoch.measurements) == 23


def test_repeated_frame_is_counted_and_the_first_stands(blocks):
    row = where(blocks[0], "RANGE", 1, channel=0)[0]
    epoch, rejected = taken(concat([blocks[0], blocks[0][row]]))
    assert rejected == {Verdict.REPEATED: 1}
    assert len(epoch.measurements) == 24


def test_repeated_block_brings_nothing(blocks):
    epoch, rejected = taken(blocks[0], blocks[1], blocks[1])
    assert epoch.mark is None and len(epoch.measurements) == 0
    # Almanac frames come several to a stream and epoch: repeated, their counters are out of sequence.
    assert rejected[Verdict.REPEATED] == len(blocks[1]) - 36
    assert rejected.pop(Reason.TIMED_OUT) == 4, "who only repeats himself says nothing"
    assert sum(rejected.values()) == len(blocks[1])


def test_second_frame_of_one_channel_with_a_good_counter_does_not_replace_the_first(blocks):
    row = where(blocks[0], "RANGE", 1, channel=0)[0]
    bogus = blocks[0][row].data.copy()
    bogus[0, 5] ^= 0xFF
    bogus[0, 1] = (bogus[0, 1] & 0xF0) | 1
    bogus[0, 0] = e2e.crc(blocks[0].can_id[row : row + 1], bogus)[0]
    second = batch(blocks[0].can_id[row], bogus)
    epoch, rejected = taken(concat([blocks[0], second]))
    assert rejected == {Reason.SURPLUS: 1}
    assert epoch.measurements.pseudorange_m[0] == taken(blocks[0])[0].measurements.pseudorange_m[0]


def test_frames_of_another_epoch_never_mix(blocks):
    """Two blocks merged by a slow link: the newer epoch stands, the older is refused whole."""
    epoch, rejected = taken(concat(blocks))
    alone, _ = taken(*blocks)
    assert epoch.mark.epoch == 1
    assert rejected == {Verdict.MIXED_EPOCH: len(blocks[0])}
    assert np.array_equal(epoch.measurements.pseudorange_m, alone.measurements.pseudorange_m)


def test_late_frame_of_the_epoch_before_is_refused(blocks):
    row = where(blocks[0], "SV_Y", 3, channel=5)
    late = concat([blocks[1][:20], blocks[0][row], blocks[1][20:]])
    epoch, rejected = taken(without(blocks[0], row), late)
    assert rejected[Verdict.MIXED_EPOCH] == 1
    assert len(epoch.measurements) == 24


@pytest.mark.parametrize("kind", ["TIME_MARK", "TIME_GPS", "TIME_FINE"])
def test_no_time_no_epoch(blocks, kind):
    epoch, rejected = taken(without(blocks[0], where(blocks[0], kind)))
    assert epoch.mark is None and epoch.attitude is None and len(epoch.measurements) == 0
    assert rejected == {Reason.NO_TIME_MARK: len(blocks[0]) - 1}


@pytest.mark.parametrize(
    ("stretch", "good"), [(1 - 9e-5, True), (1 + 9e-5, True), (1.0003, False), (0.99, False)]
)
def test_a_quaternion_whose_norm_is_not_one_is_no_attitude(blocks, stretch, good):
    """Not normalised by its unit, or put together of two: a hundredth would be half a degree."""
    block, data = blocks[0], blocks[0].data.copy()
    for kind in ("ATT_Q01", "ATT_Q23"):
        row = where(block, kind)[0]
        values = CODEC.decode(kind, data[row : row + 1])
        q = {name: stretch * value for name, value in values.items() if name.startswith("q")}
        data[row, 2:] = CODEC.encode(kind, q)[0, 2:]
        data[row, 0] = e2e.crc(block.can_id[row : row + 1], data[row : row + 1])[0]
    epoch, rejected = taken(FrameBatch(block.t_ns, block.can_id, block.length, data))
    assert (epoch.attitude is not None) == good
    assert rejected == ({} if good else {Reason.TURNED: 1})
    if good:
        assert np.linalg.norm(epoch.attitude.quaternion_body_from_ecef) == pytest.approx(1, abs=1e-12)


def test_attitude_needs_all_its_frames(blocks):
    epoch, rejected = taken(without(blocks[0], where(blocks[0], "ATT_Q23")))
    assert epoch.attitude is None and len(epoch.measurements) == 24
    assert rejected == {Reason.INCOMPLETE: 2}


@pytest.mark.parametrize(
    ("can_id", "length", "verdict"),
    [
        (0x3FF, 8, Verdict.UNKNOWN_ID),
        (0x100 | 1 << 20, 8, Verdict.UNKNOWN_ID),
        (0x100, 7, Verdict.WRONG_LENGTH),
        (0x100 | RTR_FLAG, 8, Verdict.REMOTE),
        (0x100 | EFF_FLAG, 8, Verdict.EXTENDED),
        (ERR_FLAG | 4, 8, Verdict.ERROR_FRAME),
    ],
)
def test_form(blocks, can_id, length, verdict):
    stranger = batch(can_id, np.zeros((1, 8)), length=length)
    epoch, rejected = taken(concat([blocks[0][:50], stranger, blocks[0][50:]]))
    assert rejected == {verdict: 1}
    assert len(epoch.measurements) == 24


HITS = st.tuples(st.integers(0, 271), st.integers(0, 7), st.integers(1, 255))  # row, byte, bits


@given(st.lists(HITS, min_size=1, max_size=12, unique_by=lambda hit: hit[0]), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_no_damage_gets_through(blocks, hits, seed):
    """Any bytes changed in any frames, any order, strangers between: what arrives is right or missing."""
    whole, _ = taken(blocks[0])
    block = blocks[0]
    for row, byte, by in hits:
        block = changed(block, row % len(block), byte, by)
    rng = np.random.default_rng(seed)
    noise = batch(
        rng.integers(0, 2**32, 30, np.uint32),
        rng.integers(0, 256, (30, 8), np.uint8),
        length=rng.integers(0, 9, 30),
    )
    epoch, _ = taken(concat([noise, block, noise]))
    if epoch.mark is None:
        return
    assert epoch.mark == whole.mark
    key = {
        (r, c): k
        for k, (r, c) in enumerate(zip(whole.measurements.receiver, whole.measurements.channel, strict=True))
    }
    rows = [key[rc] for rc in zip(epoch.measurements.receiver, epoch.measurements.channel, strict=True)]
    for name in epoch.measurements.__slots__:
        assert np.array_equal(
            getattr(epoch.measurements, name), getattr(whole.measurements, name)[..., rows]
        ), name


def test_nothing_at_all():
    epoch, rejected = taken(EMPTY)
    assert epoch.mark is None and rejected == {}


def begun(block, session=7):
    return admitted(CODEC, block, session, no_rejections())[2]


def test_restart_is_told_by_a_complete_time_mark_only(blocks):
    other = FakeBus(craft(), {}, session=8).block(0)
    assert not begun(blocks[0]) and begun(other)
    for kind in ("TIME_MARK", "TIME_GPS", "TIME_FINE"):
        row = where(other, kind)
        assert not begun(changed(other, row[0], 3)), kind
        assert not begun(without(other, row)), kind
    # Both sessions in a block: the next block will tell.
    assert not begun(concat([blocks[0], other])) and not begun(concat([other, blocks[0]]))


def test_restart_needs_the_epoch_it_names(blocks):
    other = FakeBus(craft(), {}, session=8).block(0)
    row = where(other, "TIME_MARK")[0]
    assert not begun(resealed(other, row, lambda word: word ^ 1 << 32))


def resealed(block, row, change):
    """With a changed payload, validly protected."""
    data = block.data.copy()
    data[row] = np.array([change(int(data[row].view("<u8")[0])) & 2**64 - 1], "<u8").view(np.uint8)
    data[row, 0] = e2e.crc(block.can_id[row : row + 1], data[row : row + 1])[0]
    return FrameBatch(block.t_ns, block.can_id, block.length, data)


def put(block, row, kind, **values):
    """The frame of that row with these values instead, same counter and epoch."""
    header = int(block.data[row].view("<u8")[0]) & 0xFFFF
    payload = int(CODEC.encode(kind, values)[0].view("<u8")[0])
    return resealed(block, row, lambda _: payload | header)


@pytest.mark.parametrize(
    ("kind", "values", "good"),
    [
        ("TIME_GPS", {"week": 15249, "second": 604_799}, True),
        ("TIME_GPS", {"week": 15250, "second": 0}, False),
        ("TIME_GPS", {"week": 65535, "second": 604_799}, False),
        ("TIME_GPS", {"week": 1712, "second": 604_800}, False),
        ("TIME_FINE", {"nanosecond": 999_999_999}, True),
        ("TIME_FINE", {"nanosecond": 1_000_000_000}, False),
        ("TIME_MARK", {"session": 7, "epoch": 16}, True),
        ("TIME_MARK", {"session": 7, "epoch": 17}, False),
    ],
)
def test_mark_of_a_time_that_does_not_exist_is_refused(blocks, kind, values, good):
    block = put(blocks[0], where(blocks[0], kind)[0], kind, **values)
    epoch, rejected = taken(block)
    assert (epoch.mark is not None) == good
    if good:
        assert epoch.mark.t_ns < 2**63 and rejected == {}
    else:
        assert rejected == {Reason.BAD_TIME_MARK: 3, Reason.NO_TIME_MARK: len(block) - 3}


def test_node_of_another_contract_is_not_used(blocks):
    row = where(blocks[0], "HEARTBEAT", 2)[0]
    block = put(blocks[0], row, "HEARTBEAT", state=2, boot_count=1, contract_hash=CODEC.hash ^ 1)
    epoch, rejected = taken(block)
    theirs = np.isin(CODEC.number_of[block.can_id], [2])
    assert rejected == {Reason.OTHER_CONTRACT: int(theirs.sum())} and theirs.sum() == 63
    assert sorted(set(epoch.measurements.receiver.tolist())) == [0, 2, 3]
    assert epoch.boots.tolist()[:4] == [1, -1, 1, 1]


def test_time_node_of_another_contract_gives_no_time(blocks):
    beat = frames("HEARTBEAT", {"state": 2, "contract_hash": 1}, 10)
    beat, _ = e2e.protect(CODEC, beat, e2e.fresh_counters(CODEC), 0)
    epoch, rejected = taken(concat([blocks[0], beat]))
    assert epoch.mark is None
    assert rejected == {Reason.OTHER_CONTRACT: 4, Reason.NO_TIME_MARK: len(blocks[0]) - 3}


def test_silent_node_is_counted_once_an_epoch(blocks):
    dumb = [without(b, np.flatnonzero(CODEC.number_of[b.can_id] == 3)) for b in blocks]
    assert Reason.TIMED_OUT not in taken(*dumb)[1], "never heard, hence not missed"
    received, rejected = nothing_received(CODEC), no_rejections()
    for frames_in, missed in ((blocks[0], 0), (dumb[1], 1), (EMPTY, 5)):
        _, received, rejected = decode(CODEC, LIMITS, frames_in, received, rejected)
        assert rejected[Reason.TIMED_OUT].sum() == missed
    table = rejection_table(CODEC, rejected)
    assert [(row[1], row[2]) for row in table if row[0] == "TIMED_OUT"] == [
        ("0x701 RX1", 1), ("0x702 RX2", 1), ("0x703 RX3", 2), ("0x704 RX4", 1),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("number", "closing"),
    [(3, "STATUS"), (9, "ATT_RATE"), (10, "TIME_FINE")],
    ids=["RX3", "ATT", "TIME"],
)
def test_node_that_closes_its_epoch_is_not_silent_for_want_of_a_heartbeat(number, closing):
    bus = FakeBus(craft(), s.constellation(), nodes=(9, 10))
    first, second = bus.block(0), bus.block(1)
    name = CODEC.sender_of[CODEC.can_id_of["HEARTBEAT", number]]
    mine = np.array([CODEC.sender_of[i] == name for i in second.can_id])
    closes = CODEC.kind_of[second.can_id] == CODEC.kinds[closing].number
    beats = CODEC.kind_of[second.can_id] == CODEC.kinds["HEARTBEAT"].number
    for gone, missed in ((mine & beats, 0), (mine & closes, 0), (mine & (beats | closes), 1), (mine, 1)):
        _, rejected = taken(first, second[~gone])
        assert rejected.get(Reason.TIMED_OUT, 0) == missed


def test_rejections_are_explained(blocks):
    row = where(blocks[0], "SV_X", 1, channel=0)[0]
    _, _, rejected = decode(CODEC, LIMITS, changed(blocks[0], row), nothing_received(CODEC), no_rejections())
    table = rejection_table(CODEC, rejected)
    assert ("CORRUPTED", "0x103 RX1", 1, "frame ignored, its channel is out of this epoch") in table
    assert sum(n for *_, n, _ in table) == 10


def reported(block, alpha0_of):
    """With an ionosphere from each of some receivers, which differ by alpha0 [2^-30 s]."""
    beta = {"beta0": 102400.0, "beta1": 0.0, "beta2": -196608.0, "beta3": 0.0}
    more = []
    for receiver, alpha0 in alpha0_of.items():
        alpha = {"alpha0": alpha0 * 2.0**-30, "alpha1": 0.0, "alpha2": 0.0, "alpha3": 0.0}
        more += [frames("IONO_ALPHA", alpha, receiver), frames("IONO_BETA", beta, receiver)]
    if not more:
        return block
    return concat([block, e2e.protect(CODEC, concat(more), e2e.fresh_counters(CODEC), 0)[0]])


@pytest.mark.parametrize(
    ("alpha0_of", "stands", "left_out"),
    [
        ({}, None, []),
        ({3: 20}, 20, []),
        ({1: 20, 2: 20, 3: 20, 4: 20}, 20, []),
        ({1: 127, 2: 20, 3: 20, 4: 20}, 20, [1]),
        ({1: 20, 2: -128, 4: 20}, 20, [2]),
        ({2: 20, 4: 127}, 20, [4]),
        ({1: 1, 2: 2, 3: 3, 4: 3}, 3, [1, 2]),
    ],
)
def test_an_ionosphere_is_that_of_most_receivers_and_others_are_told(blocks, alpha0_of, stands, left_out):
    epoch, _, counts = decode(
        CODEC, LIMITS, reported(blocks[0], alpha0_of), nothing_received(CODEC), no_rejections()
    )
    found = None if epoch.ionosphere is None else epoch.ionosphere.alpha[0] * 2.0**30
    assert found == stands
    assert counts.sum() == counts[Reason.CONTRADICTED].sum() == 2 * len(left_out)
    of_whom = np.flatnonzero(counts[Reason.CONTRADICTED]).tolist()
    kinds = ("IONO_ALPHA", "IONO_BETA")
    assert of_whom == sorted(CODEC.can_id_of[kind, r] for r in left_out for kind in kinds)
