"""The flight software in C of examples/fsw_c, written from the contract: built, flown, compared with ours.

Two implementations that share no code agree on every fix; what differs is told where it is judged.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.tools.command_line.main import main
from tests.support.feeder import HEARTBEAT, Feeder, decoded, pack, session_of
from tests.support.fsw_c import AGREEMENT_M, COPIES_M, EPOCHS, distances_m

CODEC = codec(4)

pytestmark = [
    pytest.mark.verifies(
        "examples/fsw_c",
        what="Assignment and commands, a second time",
        by=(
            "the same channels tracked as ours, but the limb's shape, prediction and behaviour without a fix "
            "were taken from ours"
        ),
        status="modelled",
    ),
]


def fixes(folder: Path) -> pl.DataFrame:
    return pl.read_parquet(folder / "fixes.parquet")


@pytest.mark.verifies(
    "examples/fsw_c",
    "flightsw/estimation/position.py",
    what="Fix from ranges, velocity, a second time",
    by="a C flight software written from the contract, weights shared: 0.14 mm over an hour, 0.5 mm/s",
    status="modelled",
)
def test_the_same_frames_give_the_same_fixes(fsw, ours, epochs, tmp_path):
    own = fixes(ours)
    with Feeder(fsw, tmp_path) as bench:
        answers = [decoded(bench.play(epoch)) for epoch in epochs]
        assert bench.end(session_of(epochs[0]), len(epochs)) == (0, "")
    status = [answer["NAV_STATUS"][0] for answer in answers]
    assert [str(s["mode"]) for s in status] == own["mode"].to_list()
    assert [str(s["no_fix"]) for s in status] == own["no_fix"].to_list()
    assert [s["measurements"] for s in status] == own["measurements"].to_list()
    assert [s["pdop"] for s in status] == pytest.approx(own["pdop"].fill_null(0).to_list(), abs=0.011)
    both = [(a, row) for a, row in zip(answers, own.iter_rows(named=True), strict=True) if row["valid"]]
    assert len(both) > 90
    for answer, row in both:
        agreement_m = AGREEMENT_M if row["satellites"] == row["measurements"] else COPIES_M
        for axis in "xyz":
            position_m = answer[f"NAV_{axis.upper()}"][0][f"{axis}_m"]
            velocity_mps = answer[f"NAV_V{axis.upper()}"][0][f"v{axis}_mps"]
            assert position_m == pytest.approx(row[f"{axis}_ecef_m"], abs=agreement_m)
            assert velocity_mps == pytest.approx(row[f"v{axis}_ecef_mps"], abs=0.0005)
        assert answer["NAV_CLOCK"][0]["bias_m"] == pytest.approx(row["clock_bias_m"], abs=agreement_m)
        assert len(answer["NAV_USED"]) == 4
        assert sum(used["channels"].bit_count() for used in answer["NAV_USED"]) == row["measurements"]


def test_it_flies_and_commands_as_ours_does(fsw, ours, tmp_path):
    folder = tmp_path / "run"
    command = ["run", "--duration", str(EPOCHS), "--out", str(folder), "--quiet", "--flight", str(fsw)]
    assert main(command) == 0
    both = fixes(ours).join(fixes(folder), on="t_gps_s", suffix="_other")
    assert (both["valid"] == both["valid_other"]).all()
    alike = both.filter(pl.col("satellites") == pl.col("measurements"))
    assert len(alike) > 90 and distances_m(alike).max() < AGREEMENT_M
    assert distances_m(both).max() < COPIES_M
    tracked = ["t_gps_s", "receiver", "satellite"]
    own, other = (
        pl.read_parquet(path / "channels.parquet").select(tracked).unique() for path in (ours, folder)
    )
    assert len(own) == len(other) == len(own.join(other, on=tracked))
    events = pl.read_parquet(folder / "assignments.parquet")
    assert set(events.filter(pl.col("event") == "ack")["result"]) == {"ACCEPTED"}


def test_it_meets_what_the_quiet_scenario_expects(fsw, tmp_path):
    command = ["run", "soyuz-quiet", "--duration", "120", "--quiet", "--flight", str(fsw)]
    assert main([*command, "--out", str(tmp_path / "run")]) == 0


def test_it_flies_at_twenty_times_real_time_without_lockstep(fsw, tmp_path):
    folder = tmp_path / "run"
    command = ["run", "--duration", "80", "--pace", "x20", "--quiet", "--flight", str(fsw)]
    assert main([*command, "--out", str(folder)]) == 0
    flown = fixes(folder)
    assert flown["satellites"].max() >= 20  # only commanded channels see so many
    truth = pl.read_parquet(folder / "truth.parquet")
    assert flown["valid"].sum() > 20
    both = flown.join(truth.with_columns(valid=True), on="t_gps_s", suffix="_other")
    assert np.median(distances_m(both)[-10:]) < 5
    assert json.loads((folder / "summary.json").read_text("utf-8"))["mark_late_ms"] > 0


def test_a_repeated_sync_gets_the_same_answer(fsw, epochs, tmp_path):
    session = session_of(epochs[0])
    with Feeder(fsw, tmp_path) as bench:
        for number, epoch in enumerate(epochs[:45]):
            first = bench.play(epoch)
            assert bench.sync(session, number, len(epoch)) == first
        assert bench.end(session, 45) == (0, "")


@pytest.mark.parametrize(
    ("missing", "reason"),
    [
        ({0x010}, "NO_TIME_MARK"),
        ({0x011}, "NO_TIME_MARK"),
        ({0x012}, "NO_TIME_MARK"),
        ({0x060}, "NO_ATTITUDE"),
        ({0x061}, "NO_ATTITUDE"),
        (set(range(0x101, 0x180, 0x10)), "TOO_FEW_SATELLITES"),
    ],
)
def test_it_says_why_there_is_no_fix(fsw, epochs, tmp_path, missing, reason):
    session = session_of(epochs[0])
    with Feeder(fsw, tmp_path) as bench:
        for epoch in epochs[:60]:
            sound = bench.play(epoch)
        assert str(decoded(sound)["NAV_STATUS"][0]["mode"]) == "POSITION_VELOCITY"
        rest = [frame for frame in epochs[60] if frame[0] not in missing]
        bench.send(b"".join(pack(*frame) for frame in rest))
        answer = decoded(bench.sync(session, 60, len(rest)))
        assert str(answer["NAV_STATUS"][0]["no_fix"]) == reason
        assert not any(name.startswith("NAV_") and name != "NAV_STATUS" for name in answer)
        assert str(decoded(bench.play(epochs[61]))["NAV_STATUS"][0]["no_fix"]) == "FIX"


def test_without_body_rates_there_is_a_position_and_no_velocity(fsw, epochs, tmp_path):
    with Feeder(fsw, tmp_path) as bench:
        for epoch in epochs[:60]:
            bench.play(epoch)
        answer = decoded(bench.play([frame for frame in epochs[60] if frame[0] != 0x062]))
    assert str(answer["NAV_STATUS"][0]["mode"]) == "POSITION"
    assert "NAV_X" in answer and "NAV_VX" not in answer and "NAV_DRIFT" not in answer


def test_a_damaged_frame_costs_its_channel_and_no_more(fsw, epochs, tmp_path):
    with Feeder(fsw, tmp_path) as bench:
        for epoch in epochs[:60]:
            before = decoded(bench.play(epoch))["NAV_STATUS"][0]["measurements"]
        at = next(i for i, frame in enumerate(epochs[60]) if frame[0] == 0x103)
        can_id, data = epochs[60][at]
        damaged = [*epochs[60]]
        damaged[at] = can_id, data[:5] + bytes([data[5] ^ 0x10]) + data[6:]
        assert decoded(bench.play(damaged))["NAV_STATUS"][0]["measurements"] == before - 1
        assert decoded(bench.play(epochs[61]))["NAV_STATUS"][0]["measurements"] == before
        status, words = bench.end(session_of(epochs[0]), 62)
    assert (status, words) == (0, "fsw: 62 epochs, 26 fixes; 1 frames lost, 1 refused: corrupted\n")


def test_a_satellite_that_lies_is_left_out(fsw, epochs, tmp_path):
    """A pseudorange 3 km too long, as a sender's own fault: correctly protected."""
    from gnss_hil.dbc.contract.e2e import crc

    with Feeder(fsw, tmp_path) as bench:
        for epoch in epochs[:60]:
            before = decoded(bench.play(epoch))
        at = next(i for i, frame in enumerate(epochs[60]) if frame[0] == 0x110)
        word = bytearray(epochs[60][at][1])
        raw = int.from_bytes(word, "little") + (30_000_000 << 21)
        word[:] = raw.to_bytes(8, "little")
        word[0] = crc(np.array([0x110], np.uint32), np.frombuffer(bytes(word), np.uint8)[None, :])[0]
        lying = [*epochs[60]]
        lying[at] = 0x110, bytes(word)
        after = decoded(bench.play(lying))
    assert CODEC.can_id_of["RANGE", 2] == 0x110
    assert str(after["NAV_STATUS"][0]["no_fix"]) == "FIX"
    assert after["NAV_STATUS"][0]["measurements"] == before["NAV_STATUS"][0]["measurements"] - 1
    moved_m = [
        after[f"NAV_{a.upper()}"][0][f"{a}_m"] - before[f"NAV_{a.upper()}"][0][f"{a}_m"] for a in "xyz"
    ]
    assert np.linalg.norm(moved_m) == pytest.approx(7200, abs=500)  # an epoch's way, not kilometres more


def test_an_emulator_that_starts_again_finds_it_as_new(fsw, epochs, tmp_path):
    """Killed without BENCH_END, and back under the same session: nothing of the first run is remembered."""
    with Feeder(fsw, tmp_path) as bench:
        first = [bench.play(epoch) for epoch in epochs[:70]]
        assert [bench.play(epoch) for epoch in epochs[:70]] == first


def test_a_time_master_that_went_away_hears_heartbeats_again(fsw, epochs, tmp_path):
    with Feeder(fsw, tmp_path) as bench:
        bench.play(epochs[0])
        can_id, data = bench.receive()
    assert can_id == HEARTBEAT
    assert str(decoded([(can_id, data)])["FLIGHT_HEARTBEAT"][0]["state"]) == "READY"
