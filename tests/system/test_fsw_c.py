"""The flight software in C of examples/fsw_c, written from the contract: built, flown, compared with ours.

Two implementations that share no code agree on every fix; what differs is told where it is judged.
"""

from __future__ import annotations

import json
import os
import random
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from gnss_hil.dbc.common.vehicle import find
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.e2e import fresh_counters, protect
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat, to_wire
from gnss_hil.dbc.lockstep.messages import is_bench
from gnss_hil.emulator.config.scenario import find as find_scenario
from gnss_hil.tools.command_line.main import main
from tests.support.feeder import (
    HEARTBEAT,
    ROOT,
    Feeder,
    database,
    decoded,
    pack,
    protection,
    recorded,
    session_of,
)
from tests.support.outside import c_tools
from tests.support.strays import mark

EXAMPLE = ROOT / "examples" / "fsw_c"
AGREEMENT_M = 0.001  # of two least squares with the same weights; found: 0.14 mm, the step of the bus
COPIES_M = 0.01  # where antennas track the same satellites, whose common error each weighs in its own way
EPOCHS = 130
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


def build(folder: Path, target: str = "all") -> None:
    """`make` into a folder; nothing of the example's own may be warned about."""
    c_tools("gcc", "make", "sha256sum")
    bench = [
        f"PYTHON={sys.executable}",
        f"GNSS_HIL={sys.executable} -m gnss_hil.tools.command_line.main",
        f"BUILD={folder}",
    ]
    done = subprocess.run(
        ["make", "-C", EXAMPLE, "-j2", "CC=gcc", *bench, target], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stderr, done.stderr


@pytest.fixture(scope="module")
def fsw(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fsw_c")
    build(folder)
    return folder / "fsw"


@pytest.fixture(scope="module")
def sanitized(fsw) -> Path:
    build(fsw.parent, "sanitize")
    return fsw.parent / "sanitize" / "fsw"


def without_figures(folder: Path) -> Path:
    """A scenario as `soyuz`, whose vehicle file says nothing of the receivers: the flight software in C goes
    by its own figures."""
    figures = re.compile(r"^\[receivers\]\n(?:\w+ = .*\n)+", re.M)
    stripped, count = figures.subn("", find("soyuz-ms").read_text())
    assert count == 1
    (folder / "soyuz-ms.toml").write_text(stripped)
    (folder / "soyuz.toml").write_text(find_scenario("soyuz").read_text())
    return folder / "soyuz.toml"


@pytest.fixture(scope="module")
def ours(tmp_path_factory) -> Path:
    """A run of our own flight software, which is told no more of the receivers than the one in C goes by."""
    folder = tmp_path_factory.mktemp("runs")
    soyuz = without_figures(folder)
    words = ["run", str(soyuz), "--bus", "inline", "--duration", str(EPOCHS), "--quiet"]
    assert main([*words, "--out", str(folder / "ours")]) == 0
    return folder / "ours"


@pytest.fixture(scope="module")
def epochs(ours) -> list:
    return recorded(ours / "bus.log")


def fixes(folder: Path) -> pl.DataFrame:
    return pl.read_parquet(folder / "fixes.parquet")


def distances_m(both: pl.DataFrame) -> np.ndarray:
    """Between the positions of two runs, epochs where both have a fix."""
    valid = both.filter(pl.col("valid") & pl.col("valid_other"))
    return np.sqrt(sum((valid[f"{a}_ecef_m"] - valid[f"{a}_ecef_m_other"]).to_numpy() ** 2 for a in "xyz"))


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


def test_rubbish_on_the_bus_neither_stops_it_nor_moves_a_fix(sanitized, epochs, tmp_path):
    """Random identifiers, lengths, flags and data among the frames; under the sanitizers."""
    draw = random.Random(7)
    calm, noisy = tmp_path / "calm", tmp_path / "noisy"
    calm.mkdir()
    noisy.mkdir()

    def stray() -> bytes:
        identifier = draw.choice((draw.getrandbits(11), draw.getrandbits(32), draw.randrange(0x100, 0x180)))
        return pack(identifier, draw.randbytes(8), draw.choice((8, 8, 8, 0, 5, 255)))

    with Feeder(sanitized, calm) as bench:
        undisturbed = [bench.play(epoch) for epoch in epochs[:90]]
        assert bench.end(session_of(epochs[0]), 90) == (0, "")
    with Feeder(sanitized, noisy) as bench:
        bench.send(b"".join(stray() for _ in range(3000)))
        disturbed = [bench.play(epoch, [stray() for _ in range(250)]) for epoch in epochs[:90]]
        status, words = bench.end(session_of(epochs[0]), 90)
    assert status == 0 and "refused" in words and "ERROR" not in words and "runtime error" not in words
    for ours, theirs in zip(undisturbed, disturbed, strict=True):
        for name in ("NAV_X", "NAV_Y", "NAV_Z"):
            assert name not in decoded(ours) or abs(_metres(ours, name) - _metres(theirs, name)) < 50


HOSTILE = 1_000_000
FRAMES, SHARE = 2500, 0.3
"""Frames of a hostile epoch, and the share of the recorded ones whose contents are made up."""


def _hostile_epoch(draw: np.random.Generator, epoch: list, number: int, counters: np.ndarray):
    """A recorded epoch in which any field may say anything, protected, amid frames of any kind. Three of five
    keep their measurements, attitude and time, so that there is something to solve."""
    calm = number % 5 < 3
    known = [(i, d) for i, d in epoch if i not in (0x010, 0x011, 0x012)]
    every = np.array(sorted({*CODEC.can_id_of.values()}), np.uint32)
    if calm:
        every = every[(every < 0x060) | (every >= 0x180)]
    if number % 5 != 4:  # whose heartbeat says another contract is not heard
        every = every[every < 0x700]
    n = FRAMES - len(known)
    can_id = np.concatenate([np.array([i for i, _ in known], np.uint32), draw.choice(every, n)])
    data = np.concatenate(
        [np.frombuffer(b"".join(d for _, d in known), np.uint8).reshape(-1, 8), np.zeros((n, 8), np.uint8)]
    )
    styles = (draw.integers(0, 256, data.shape), draw.choice([0, 1, 127, 128, 255], data.shape), 0, 255)
    made_up = np.r_[(draw.random(len(known)) < SHARE) & (number % 5 == 4), np.ones(n, bool)]
    style = draw.integers(0, len(styles), len(data))
    for k, said in enumerate(styles):
        rows = made_up & (style == k)
        data[rows] = np.broadcast_to(said, data.shape)[rows]
    order = draw.permutation(len(data))
    week, second = 1712, 260_100 + number
    if not calm:
        week, second = int(draw.choice([0, 1713, 15_249, 15_250, 65_535])), int(draw.choice([0, 604_799]))
    marks = {
        "TIME_MARK": {"session": 7, "epoch": number},
        "TIME_GPS": {"week": week, "second": second},
        "TIME_FINE": {"nanosecond": 0, "leap": 18, "mark_clock": 0 if calm else int(draw.integers(0, 16))},
    }
    opening = [batch(CODEC.can_id_of[kind, 0], CODEC.encode(kind, said, 1)) for kind, said in marks.items()]
    can_id, data = can_id[order], data[order]
    keep = ~is_bench(can_id) & ((can_id < 0x010) | (can_id > 0x012))
    frames = concat([*opening, batch(can_id[keep], data[keep])])
    return protect(CODEC, frames, counters, number)


def _wild(draw: np.random.Generator, frames: FrameBatch) -> bytes:
    """As on the wire; some with flags, lengths and damage of the bus's own."""
    wild = draw.random(len(frames)) < 0.02
    wild[:3] = False
    can_id, length, data = frames.can_id.copy(), frames.length.copy(), frames.data.copy()
    can_id[wild] |= draw.choice(np.array([0, 1 << 29, 1 << 30, 1 << 31], np.uint32), wild.sum())
    length[wild] = draw.choice(np.array([0, 3, 7, 8, 255], np.uint8), wild.sum())
    data[wild, draw.integers(0, 8, wild.sum())] ^= 1
    return to_wire(FrameBatch(frames.t_ns, can_id, length, data))


@pytest.mark.slow(seconds=20)
def test_a_million_hostile_frames_do_nothing_undefined(sanitized, epochs, tmp_path):
    """Under the address and undefined-behaviour sanitizers; every epoch is answered."""
    draw, counters, sent, number, fixes = np.random.default_rng(20), fresh_counters(CODEC), 0, 0, 0
    with Feeder(sanitized, tmp_path) as bench:
        while sent < HOSTILE:
            frames, counters = _hostile_epoch(draw, epochs[number % len(epochs)], number, counters)
            bench.send(_wild(draw, frames))
            answer = decoded(bench.sync(7, number, len(frames)))
            assert len(answer["NAV_STATUS"]) == 1
            fixes += "NAV_X" in answer
            sent, number = sent + len(frames), number + 1
        status, words = bench.end(7, number)
    assert status == 0 and "ERROR" not in words and "runtime error" not in words
    assert sent >= HOSTILE and fixes > 0


def test_a_mark_far_ahead_does_not_make_it_deaf(fsw, epochs, tmp_path):
    session = session_of(epochs[0])
    with Feeder(fsw, tmp_path) as bench:
        calm = [bench.play(epoch) for epoch in epochs[:60]]
    (tmp_path / "again").mkdir()
    with Feeder(fsw, tmp_path / "again") as bench:
        for number, epoch in enumerate(epochs[:60]):
            strays = (
                [mark(session, number + ahead) for ahead in (1, 16, 17, 2**20, 2**31)] if number > 40 else []
            )
            assert bench.play(epoch, [*strays, mark(0xBEEF, 5)]) == calm[number]
        status, words = bench.end(session, 60)
    assert status == 0 and words.endswith("bench frames or time marks refused\n")


def _changed(epochs: list, number: int, changes: dict[int, Callable[[dict], dict]]) -> list:
    """A recorded epoch with other values in frames of some identifiers, protected anew."""
    changed = []
    for can_id, data in epochs[number]:
        if can_id in changes:
            message = database().get_message_by_frame_id(can_id)
            said = message.decode(data, decode_choices=False)
            raw = bytearray(message.encode(said | changes[can_id](said), strict=False))
            raw[0] = protection(can_id, bytes(raw))
            data = bytes(raw)
        changed.append((can_id, data))
    return changed


def test_a_week_beyond_what_nanoseconds_hold_is_no_time(sanitized, epochs, tmp_path):
    with Feeder(sanitized, tmp_path) as bench:
        for epoch in epochs[:60]:
            bench.play(epoch)
        for number, week in ((60, 15_250), (61, 65_535)):
            far = _changed(epochs, number, {0x011: lambda said, week=week: {"week": week}})
            assert str(decoded(bench.play(far))["NAV_STATUS"][0]["no_fix"]) == "NO_TIME_MARK"
        assert str(decoded(bench.play(epochs[62]))["NAV_STATUS"][0]["no_fix"]) == "FIX"


def test_a_satellite_inside_the_earth_is_none(fsw, epochs, tmp_path):
    inside = {base: lambda said, axis=axis: {f"{axis}_m": 1e6} for base, axis in ((0x103, "x"), (0x104, "y"))}
    inside[0x105] = lambda said: {"z_m": 1e6}
    with Feeder(fsw, tmp_path) as bench:
        before = [decoded(bench.play(epoch)) for epoch in epochs[:110]][-1]
        after = decoded(bench.play(_changed(epochs, 110, inside)))
    used, still = ({u["receiver"]: u["channels"] for u in answer["NAV_USED"]} for answer in (before, after))
    assert used[1] and not still[1] and still[2] == used[2]


def test_a_velocity_that_no_frame_carries_is_not_sent(sanitized, epochs, tmp_path):
    """Range rates as if the craft flew at 18 km/s along z and satellites stood: a position, no velocity."""
    with Feeder(sanitized, tmp_path) as bench:
        answer = [decoded(bench.play(epoch)) for epoch in epochs[:111]][-1]
        craft_m = np.array([answer[f"NAV_{a.upper()}"][0][f"{a}_m"] for a in "xyz"])
        changes, heard = {}, decoded(epochs[110])
        for r in range(4):
            xyz = [{s["channel"]: s[f"{a}_m"] for s in heard[f"RX{r + 1}_SV_{a.upper()}"]} for a in "xyz"]
            los = {k: np.array([axis[k] for axis in xyz]) - craft_m for k in xyz[0]}
            rate = {k: -18_000.0 * v[2] / np.linalg.norm(v) for k, v in los.items()}
            changes[0x101 + 0x10 * r] = lambda said, rate=rate: {
                "range_rate_mps": float(np.clip(rate[said["channel"]], -13_400, 13_400))
            }
            for base, axis in ((0x106, "vx"), (0x107, "vy"), (0x108, "vz")):
                changes[base + 0x10 * r] = lambda said, axis=axis: {f"{axis}_mps": 0.0}
        answer = decoded(bench.play(_changed(epochs, 111, changes)))
    assert str(answer["NAV_STATUS"][0]["mode"]) == "POSITION"
    assert "NAV_X" in answer and not {"NAV_VX", "NAV_VY", "NAV_VZ", "NAV_DRIFT"} & {*answer}


def _metres(answer, name: str) -> float:
    return decoded(answer)[name][0][f"{name[-1].lower()}_m"]


SHIPPED = find("soyuz-ms")
GOOD, TWO = SHIPPED.read_text(), find("soyuz-ms-l1l2").read_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD.replace("channels = 6", "channels = 33", 1), "channels: found 33, allowed is a whole number"),
        (GOOD.replace("receiver = 2", "receiver = 1"), "two antennas have the same receiver"),
        (GOOD.replace("mask_deg = 85.0\n", "", 1), "an antenna needs name, receiver, channels"),
        (GOOD.replace("mask_deg = 85.0", "mask_deg = nan", 1), "mask_deg: found nan, allowed is an angle"),
        (GOOD.replace("[0.573576436351046, 0.0,", "[0.9, 0.0,", 1), "allowed is three numbers of length 1"),
        (GOOD.replace("channels = 6", "chanels = 6", 1), "chanels: unknown key"),
        (GOOD.replace("channels = 6", "channels = 6\nchannels = 6", 1), "this key was given before"),
        (TWO.replace('["L2C", "L2OF"]', '["L2C" "L2OF"]', 1), "other_signals: found"),
        (TWO.replace('["L2C", "L2OF"]', '["L2C", L2OF]', 1), "allowed is names of signals in brackets"),
        (TWO.replace('["L2C", "L2OF"]', '["L2C"', 1), "other_signals: found"),
        (GOOD.split("[[antenna]]")[0], "no [[antenna]]"),
        (GOOD.rsplit("[[antenna]]", 1)[0], "3 antennas; this program was built for 4 (make RECEIVERS=3)"),
        ("\0\xff" * 300, "longer than 510 characters"),
    ],
)  # fmt: skip
def test_a_vehicle_file_with_a_fault_is_one_clear_line(sanitized, tmp_path, text, words):
    path = tmp_path / "vehicle.toml"
    path.write_bytes(text.encode("latin-1"))
    done = subprocess.run(
        [sanitized, "--bus", "embedded:/nowhere", "--vehicle", path], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr.startswith(f"fsw: {path}, line ") and words in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ([], 2, "no bus: give --bus or set GNSS_HIL_BUS"),
        (["--bus", "embedded:/x"], 2, "no vehicle file: give --vehicle or set GNSS_HIL_VEHICLE"),
        (["--bus"], 2, "--bus needs a value (see --help)"),
        (["--colour"], 2, "unknown argument '--colour' (see --help)"),
        (["--bus", "embedded:/x", "--vehicle", "/nowhere"], 2, "vehicle file /nowhere: No such file"),
        (["--bus", "embedded:/x", "--vehicle", SHIPPED], 3, "bus embedded:/x: No such file"),
        (["--bus", "embedded:/x", "--vehicle", find("soyuz-ms-l1l2")], 3, "bus embedded:/x: No such file"),
        (["--bus", "socketcan:can9", "--vehicle", SHIPPED], 3, "bus socketcan:can9: no such CAN"),
        (["--bus", "usb:1", "--vehicle", SHIPPED], 3, "allowed are embedded:PATH and socketcan:"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_clear_line(fsw, arguments, status, words):
    bare = {name: value for name, value in os.environ.items() if not name.startswith("GNSS_HIL")}
    done = subprocess.run([fsw, *arguments], capture_output=True, text=True, env=bare)
    assert (done.returncode, done.stdout) == (status, "")
    assert done.stderr.startswith("fsw: ") and words in done.stderr and done.stderr.count("\n") == 1


def test_an_interrupt_ends_it(fsw, epochs, tmp_path):
    with Feeder(fsw, tmp_path) as bench:
        bench.play(epochs[0])
        bench.process.send_signal(2)
        assert bench.leave() == (130, "")


def test_a_bus_that_goes_away_during_a_run_is_a_failure(fsw, epochs, tmp_path):
    with Feeder(fsw, tmp_path) as bench:
        bench.play(epochs[0])
        bench.bus.close()
        assert bench.leave()[0] == 1


def test_ends_of_lines_are_no_part_of_the_contract(tmp_path):
    c_tools("make", "sha256sum")
    dbc = tmp_path / "crlf.dbc"
    dbc.write_bytes(codec(4).text.replace("\n", "\r\n").encode("ascii"))
    target = tmp_path / "build" / "contract_hash.h"
    made = ["make", "-C", EXAMPLE, f"BUILD={target.parent}", f"DBC={dbc}", target]
    done = subprocess.run(list(map(str, made)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"CONTRACT_HASH 0x{codec(4).hash:08x}U" in target.read_text()
    assert "CONTRACT_RECEIVERS 4" in target.read_text()
