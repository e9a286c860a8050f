"""The flight software in C amid frames that no bench sends: rubbish, lies, marks far ahead."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.e2e import fresh_counters, protect
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat, to_wire
from gnss_hil.dbc.lockstep.messages import is_bench
from tests.support.feeder import Feeder, database, decoded, pack, protection, session_of
from tests.support.strays import mark

pytestmark = pytest.mark.verifies(what="Assignment and commands, a second time")

CODEC = codec(4)


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
