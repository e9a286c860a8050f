"""What the report reads out of frames: against values that were put in, and against faults."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.dbc.contract import codec, e2e
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, batch, concat
from gnss_hil.emulator.truth import TRUTH
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results import parquet, tables
from gnss_hil.tools.results.summary import craft_summary, judge, metrics
from gnss_hil.tools.results.text import not_sent

CODEC = codec.codec(4)
WEEK, SECOND = 1712, 259_200
SAT_M = np.array(
    [
        [2e7, 1e6, 1.5e7],
        [-1e6, 2.1e7, 1.4e7],
        [1.6e7, -1.3e7, 1.6e7],
        [1.2e7, 1.3e7, 1.9e7],
        [4e6, 5e6, 2.6e7],
    ]
)
CRAFT_M = np.array([3.1e6, 2.2e6, 5.6e6])


def frames_of(kind: str, number: int = 0, n: int = 1, **values) -> FrameBatch:
    return batch([CODEC.can_id_of[kind, number]] * n, CODEC.encode(kind, values, n))


def channel(receiver: int, number: int, row: int) -> FrameBatch:
    """The ten frames of a channel that tracks GPS `row` + 1."""
    x, y, z = SAT_M[row]
    said = {
        "RANGE": {"pseudorange_m": 2.2e7 + row}, "RATE": {"cn0_dbhz": 40.25, "lock": 5},
        "PHASE": {"phase_cyc": -1.5}, "SV_X": {"x_m": x}, "SV_Y": {"y_m": y}, "SV_Z": {"z_m": z},
        "SV_VX": {}, "SV_VY": {}, "SV_VZ": {"vz_mps": -3},
        "SV_CLOCK": {"sat_system": 0, "sat_number": row + 1, "clock_m": 12.5},
    }  # fmt: skip
    return concat([frames_of(kind, receiver, channel=number, **values) for kind, values in said.items()])


def navigation(mode: int = 2, used: dict[int, int] | None = None, satellites: int = 5) -> FrameBatch:
    parts = [frames_of("NAV_STATUS", mode=mode, satellites=satellites, measurements=6, pdop=1.25)]
    if mode:
        for i, axis in enumerate("xyz"):
            parts.append(frames_of(f"NAV_{axis.upper()}", **{f"{axis}_m": CRAFT_M[i]}))
            parts.append(frames_of(f"NAV_V{axis.upper()}", **{f"v{axis}_mps": i}))
        parts += [frames_of("NAV_CLOCK", item=8, bias_m=9), frames_of("NAV_CLOCK", item=0, bias_m=-77.125)]
        for receiver, channels in (used or {}).items():
            parts.append(frames_of("NAV_USED", receiver=receiver, channels=channels))
    return concat(parts)


class Sender:
    """Protects blocks as sender of all nodes."""

    def __init__(self):
        self.counters = e2e.fresh_counters(CODEC)

    def block(self, epoch: int, *parts: FrameBatch) -> FrameBatch:
        opening = (
            frames_of("TIME_MARK", session=1, epoch=epoch),
            frames_of("TIME_GPS", week=WEEK, second=SECOND + epoch),
            frames_of("TIME_FINE", nanosecond=0, leap=16, mark_clock=0),
        )
        frames, self.counters = e2e.protect(CODEC, concat([*opening, *parts]), self.counters, epoch)
        return frames

    def alone(self, epoch: int, frames: FrameBatch) -> FrameBatch:
        """Frames of an epoch without its mark."""
        frames, self.counters = e2e.protect(CODEC, frames, self.counters, epoch)
        return frames


def digested(*blocks: FrameBatch, piece: int = 10**6) -> tuple[Digest, dict[str, np.ndarray]]:
    tables: list[dict] = []
    digest, frames = Digest(CODEC, tables.append), concat(blocks)
    for i in range(0, len(frames), piece):
        digest.feed(frames[i : i + piece])
    digest.finish()
    return digest, {k: np.concatenate([t[k] for t in tables]) for k in tables[0]} if tables else {}


FIVE = [channel(1, 0, 0), channel(1, 3, 1), channel(2, 0, 2), channel(3, 5, 3), channel(4, 1, 4)]
USED = {1: 0b1001, 2: 1, 3: 0b100000, 4: 0b10}


@pytest.fixture(params=[1, 7, 10**6], ids=["frame-by-frame", "sevens", "at-once"])
def piece(request) -> int:
    return request.param


def test_values_come_out_as_they_went_in(piece):
    sender = Sender()
    blocks = [sender.block(e, *FIVE, navigation(used=USED)) for e in range(4)]
    digest, cells = digested(*blocks, piece=piece)
    fixes = digest.fixes
    assert digest.epochs == 4
    assert fixes["t_ns"].tolist() == [WEEK * NS_PER_WEEK + (SECOND + e) * NS_PER_S for e in range(4)]
    assert fixes["valid"].all()
    assert np.column_stack([fixes[f"{a}_m"] for a in "xyz"]) == pytest.approx(
        np.tile(CRAFT_M, (4, 1)), abs=1e-9
    )
    assert fixes["clock_bias_m"].tolist() == [-77.125] * 4
    assert fixes["satellites_used"].tolist() == [5] * 4
    assert len(cells["sat"]) == 20
    assert cells["used"].all()
    assert cells["pseudorange_m"][:5] == pytest.approx(2.2e7 + np.arange(5))
    assert (cells["receiver"][:5].tolist(), cells["channel"][:5].tolist()) == (
        [1, 1, 2, 3, 4],
        [0, 3, 0, 5, 1],
    )
    assert digest.counters.received == sum(map(len, blocks))
    assert (digest.counters.lost, digest.counters.reasons) == (0, {})


@pytest.mark.verifies(
    "tools/decoder/dilution.py",
    what="Dilution of a fix, from the bus alone",
    by="the textbook's PDOP",
    status="validated",
)
def test_pdop_is_the_textbooks():
    """PDOP = sqrt(trace of the position block of (G^T G)^-1), Kaplan & Hegarty, 3rd ed., section 11.2."""
    digest, _ = digested(Sender().block(0, *FIVE, navigation(used=USED)))
    line = SAT_M - CRAFT_M
    design = np.column_stack([line / np.linalg.norm(line, axis=1)[:, None], np.ones(5)])
    expected = np.sqrt(np.trace(np.linalg.inv(design.T @ design)[:3, :3]))
    assert digest.fixes["pdop_distinct"][0] == pytest.approx(expected, rel=1e-9)


def test_a_satellite_on_two_antennas_counts_once():
    twice = [*FIVE, channel(2, 1, 0), channel(3, 0, 0)]
    once, _ = digested(Sender().block(0, *FIVE, navigation(used=USED)))
    more, cells = digested(Sender().block(0, *twice, navigation(used={**USED, 2: 0b11, 3: 0b100001})))
    assert len(cells["sat"]) == 7
    assert more.fixes["satellites_used"][0] == 5
    assert more.fixes["pdop_distinct"][0] == pytest.approx(once.fixes["pdop_distinct"][0], rel=1e-9)


def test_a_fix_without_lists_has_the_satellites_that_its_status_counts(tmp_path):
    """A flight software may leave NAV_USED out: then nobody says which channels are in its fix, and none of
    its figures is 0."""
    import polars

    sender, cells = Sender(), []
    digest = Digest(CODEC, cells.append)
    for epoch, answer in enumerate((navigation(mode=0), navigation(), navigation(satellites=0))):
        digest.feed(sender.block(epoch, *FIVE, answer))
    digest.finish()
    tables.write_fixes_and_truth(tmp_path, {"soyuz": digest}, None)
    fixes = polars.read_parquet(tmp_path / "fixes.parquet")
    assert fixes["satellites_used"].to_list() == [0, None, None]
    assert fixes["satellites_used"].dtype == polars.Int64
    columns = [tables.columns_of(tables.CHANNELS, "soyuz", piece) for piece in cells]
    parquet.write(tmp_path / "channels.parquet", columns)
    used = polars.read_parquet(tmp_path / "channels.parquet")["used"]
    assert used.dtype == polars.Boolean and used.to_list() == [False] * 5 + [None] * 10

    figures = craft_summary(digest, np.zeros(0), 3)
    assert figures["fixes"] == 2 and figures["fixes_without"]["NAV_USED"] == 2
    assert figures["satellites_tracked"] == {"mean": 5, "min": 5, "max": 5}
    assert figures["satellites_paired"]["max"] is None and figures["pdop_distinct"]["median"] is None
    assert not_sent(figures).startswith(
        "NAV_USED (satellites as NAV_STATUS counts them), NAV_DRIFT, NAV_SIGMA"
    )


def test_figures_that_a_fix_states_nowhere_are_not_known_and_not_judged_as_0():
    digest, _ = digested(Sender().block(0, *FIVE, navigation(satellites=0)))
    figures = craft_summary(digest, np.zeros(0), 1)
    assert figures["satellites_tracked"] == {"mean": None, "min": None, "max": None}
    assert "NAV_USED (and NAV_STATUS counts no satellites)" in not_sent(figures)
    (row,) = judge({"satellites_tracked.max": {"max": 10}}, metrics(figures))
    assert (row["found"], row["met"]) == (None, False)


def test_a_fix_with_all_its_frames_lacks_nothing():
    others = {
        "NAV_SIGMA": {}, "NAV_CORR": {}, "NAV_VSIGMA": {}, "NAV_VCORR": {},
        "NAV_DRIFT": {"item": 0}, "NAV_CLOCK_SIGMA": {"item": 0},
    }  # fmt: skip
    more = [frames_of(kind, **values) for kind, values in others.items()]
    digest, _ = digested(Sender().block(0, *FIVE, navigation(used=USED), *more))
    figures = craft_summary(digest, np.zeros(0), 1)
    assert set(figures["fixes_without"].values()) == {0} and not not_sent(figures)


def test_too_few_satellites_have_no_pdop():
    digest, _ = digested(Sender().block(0, *FIVE[:3], navigation(used=USED)))
    assert digest.fixes["satellites_used"][0] == 3
    assert np.isnan(digest.fixes["pdop_distinct"][0])


def test_an_epoch_without_fix_is_a_row_that_is_not_valid():
    sender = Sender()
    digest, _ = digested(sender.block(0, navigation(mode=0)), sender.block(1, *FIVE, navigation(used=USED)))
    assert digest.fixes["valid"].tolist() == [False, True]
    assert np.isnan(digest.fixes["x_m"][0])


@pytest.mark.parametrize("kind", ["NAV_X", "NAV_VZ"])
def test_a_fix_with_a_frame_missing_is_not_valid(kind):
    block = Sender().block(0, *FIVE, navigation(used=USED))
    digest, _ = digested(block[block.can_id != CODEC.can_id_of[kind, 0]])
    assert digest.fixes["valid"].tolist() == [False]


@pytest.mark.parametrize("velocity_sent", [False, True], ids=["without-velocity", "with-idle-velocity"])
def test_a_fix_of_position_alone_is_valid_and_has_no_velocity(velocity_sent):
    sender, velocity_ids = Sender(), [CODEC.can_id_of[f"NAV_V{axis}", 0] for axis in "XYZ"]
    alone = navigation(mode=1, used=USED)
    if not velocity_sent:
        alone = alone[~np.isin(alone.can_id, velocity_ids)]
    digest, _ = digested(sender.block(0, *FIVE, alone), sender.block(1, *FIVE, navigation(used=USED)))
    fixes = digest.fixes
    assert fixes["valid"].tolist() == [True, True]
    assert fixes["satellites_used"].tolist() == [5, 5]
    assert np.isnan(fixes["vx_mps"]).tolist() == [True, False]

    truth = np.zeros(2, TRUTH)
    truth["t_gps_ns"], truth["position_ecef_m"] = fixes["t_ns"], CRAFT_M + np.diag([3, 1, 0])[:2]
    truth["velocity_ecef_mps"] = [0, 1, 2.5]
    figures = craft_summary(digest, truth)
    assert figures["fixes"] == 2
    assert (figures["position_error_m"]["max"], figures["velocity_error_mps"]["max"]) == (3, 0.5)


def test_the_velocity_of_a_fix_without_one_is_null_in_the_table(tmp_path):
    import polars

    digest, _ = digested(Sender().block(0, *FIVE, navigation(mode=1, used=USED)))
    tables.write_fixes_and_truth(tmp_path, {"soyuz": digest}, None)
    row = polars.read_parquet(tmp_path / "fixes.parquet").row(0, named=True)
    assert (row["valid"], row["mode"], row["vx_ecef_mps"]) == (True, "POSITION", None)
    assert row["x_ecef_m"] == pytest.approx(CRAFT_M[0], abs=1e-9)


@pytest.mark.parametrize("mode", [3, 7])
def test_a_fix_of_unknown_mode_is_not_valid(mode):
    digest, _ = digested(Sender().block(0, *FIVE, navigation(mode=mode, used=USED)))
    assert digest.fixes["valid"].tolist() == [False]


@pytest.mark.parametrize("kind", ["NAV_Y", "NAV_Z"])
def test_a_fix_of_position_alone_with_a_frame_missing_is_not_valid(kind):
    block = Sender().block(0, *FIVE, navigation(mode=1, used=USED))
    digest, _ = digested(block[block.can_id != CODEC.can_id_of[kind, 0]])
    assert digest.fixes["valid"].tolist() == [False]


def test_a_channel_with_a_frame_missing_is_out():
    block = Sender().block(0, *FIVE, navigation(used=USED))
    gone = np.flatnonzero(block.can_id == CODEC.can_id_of["SV_VY", 3])
    digest, cells = digested(block[np.delete(np.arange(len(block)), gone)])
    assert 4 not in cells["sat"]
    assert digest.fixes["satellites_used"].tolist() == [4]


def test_bad_frames_are_counted_by_reason_and_change_nothing():
    sender = Sender()
    good = [sender.block(e, *FIVE, navigation(used=USED)) for e in range(12)]
    spoilt = good[3][1:2]
    corrupted = FrameBatch(spoilt.t_ns, spoilt.can_id, spoilt.length, spoilt.data ^ np.uint8(1 << 5))
    strangers = concat([batch([0x7A0], b"unknown!"), batch([0x10], b"short", length=5)])
    old, _ = e2e.protect(CODEC, navigation(mode=0)[:1], sender.counters, 1)  # right counter, epoch long gone
    digest, _ = digested(*good[:3], corrupted, strangers, *good[3:], old)
    clean, _ = digested(*good)
    reasons = digest.counters.reasons
    assert reasons == {"CORRUPTED": 1, "UNKNOWN_ID": 1, "WRONG_LENGTH": 1, "MIXED_EPOCH": 1}
    assert digest.fixes["valid"].sum() == 12
    assert (digest.fixes["x_m"] == clean.fixes["x_m"]).all()


def test_lost_frames_are_counted_by_their_streams():
    sender = Sender()
    blocks = [sender.block(e, *FIVE, navigation(used=USED)) for e in range(3)]
    block = blocks[1]
    digest, _ = digested(blocks[0], block[block.can_id != CODEC.can_id_of["NAV_STATUS", 0]], blocks[2])
    assert digest.counters.lost == 1
    assert len(digest.fixes["t_ns"]) == 2


def test_an_answer_after_the_next_mark_belongs_to_its_own_epoch(piece):
    sender = Sender()
    blocks = [sender.block(e, *FIVE) for e in range(4)]
    answers = [e2e.protect(CODEC, navigation(used=USED), e2e.fresh_counters(CODEC), 0)[0]]
    heard = [blocks[0], blocks[1], answers[0], blocks[2], blocks[3]]
    digest, _ = digested(*heard, piece=piece)
    assert digest.fixes["t_ns"].tolist() == [WEEK * NS_PER_WEEK + SECOND * NS_PER_S]
    assert digest.fixes["satellites_used"].tolist() == [5]


def test_an_answer_to_an_epoch_before_the_first_belongs_to_none(piece):
    """Who joins a running bus may hear the answer to an epoch whose mark it has missed."""
    sender = Sender()
    missed = sender.block(6, *FIVE, navigation(used=USED))
    digest, _ = digested(sender.block(7, *FIVE), missed[-5:], sender.block(8, *FIVE), piece=piece)
    assert digest.epochs == 2 and not len(digest.fixes["t_ns"])
    assert digest.counters.reasons["MIXED_EPOCH"] == 5


def test_a_damaged_mark_opens_no_epoch_and_its_frames_belong_to_none(piece):
    sender = Sender()
    blocks = [sender.block(epoch, *FIVE, navigation(used=USED)) for epoch in range(3)]
    blocks[1].data[0, 5] ^= 1
    digest, _ = digested(*blocks, piece=piece)
    assert digest.epochs == 2
    assert (digest.fixes["t_ns"] // NS_PER_S % 604_800).tolist() == [SECOND, SECOND + 2]
    assert digest.counters.reasons == {"CORRUPTED": 1, "MIXED_EPOCH": len(blocks[1]) - 1}


@pytest.mark.parametrize("order", [(0, 3, 5), (5, 3, 0), (3, 0, 5)])
def test_the_clock_of_a_fix_is_that_of_its_lowest_domain(order):
    clocks = [frames_of("NAV_CLOCK", item=item, bias_m=10.0 + item) for item in order]
    digest, _ = digested(Sender().block(0, *FIVE, navigation(used=USED)[:-1], *clocks))
    without_zero, _ = digested(Sender().block(0, frames_of("NAV_STATUS", mode=0), clocks[0], clocks[1]))
    assert digest.fixes["clock_bias_m"].tolist() == [10.0]
    assert without_zero.fixes["clock_bias_m"].tolist() == [10.0 + min(order[:2])]
    assert digest.fixes["clock_domain"].tolist() == [0]
    assert without_zero.fixes["clock_domain"].tolist() == [min(order[:2])]


def test_nothing_and_rubbish_raise_nothing():
    digest = Digest(CODEC)
    digest.feed(EMPTY)
    digest.feed(batch([0x7A0, 0x40], np.full((2, 8), 255)))
    digest.finish()
    assert (digest.epochs, digest.bits.sum()) == (0, 0)
    assert {len(column) for column in (*digest.fixes.values(), *digest.timeline.values())} == {0}


def test_satellites_measured_are_those_whose_frames_came_whole():
    sender = Sender()
    twice = channel(2, 1, 0)
    short = channel(3, 2, 4)[:-1]
    digest, _ = digested(sender.block(0, *FIVE, twice), sender.block(1, *FIVE[:2], short))
    assert digest.timeline["satellites_measured"].tolist() == [5, 2]


def command(receiver: int, number: int, action: int, sat: int, transaction: int) -> FrameBatch:
    return frames_of(
        "COMMAND", receiver, channel=number, action=action, sat_number=sat, transaction=transaction
    )


def test_commands_repeats_handovers_and_refusals():
    track, release = 1, 0
    sender = Sender()
    ack = frames_of("ACK", 1, channel=0, result=4, sat_number=7, transaction=1)
    digest, _ = digested(
        sender.block(0, command(1, 0, track, 7, 1), command(1, 1, track, 8, 2)),
        sender.block(1, ack, command(1, 0, track, 7, 1)),
        sender.block(2, command(1, 1, release, 0, 3), command(2, 0, track, 8, 4)),
        sender.block(3, command(2, 0, release, 0, 5)),
        sender.block(4, command(3, 0, track, 8, 6)),
    )
    log = digest.commands
    assert (log.commands, log.repeats, log.handovers, log.rejected) == (6, 1, 1, 1)
    assert log.events["result"].count("UNHEALTHY") == 1
    assert log.events["satellite"][:2] == ["G07", "G08"]
