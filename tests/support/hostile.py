"""Hostile frames by the million, against all that listens: does anything raise, grow, or believe them?

    python -m tests.support.hostile RUN [--frames 10000000] [--seed 1] [--bus embedded:PATH]

takes the record of a run and plays its epochs with as many frames put in between as it has itself, in five
ways: random octets under any identifier, sound frames with one to eight of their bits turned (these in
place of the sound ones too, one in fifty), frames of earlier epochs as they were, frames that say anything
under a right CRC, and frames that are none of the contract (remote, extended, error, other lengths). The
flight software and the emulator hear them, and what a recorder and a monitor do with a bus is done. An
exception ends it; a fix that calls itself tested and is farther than 5.33 of its own sigmas from the truth
is counted, and so are turned frames that the CRC passes. With --bus the hostile frames alone go to a bus,
as fast as it takes them: to a bench that runs there.
"""

from __future__ import annotations

import argparse
import resource
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from gnss_hil.dbc.bus.base import LinkClosed
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.common.vehicle import load
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG, FrameBatch, concat
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.records.solution import Tested
from gnss_hil.tools.decoder.screen import Screen
from gnss_hil.tools.monitor.format import Formatter
from gnss_hil.tools.monitor.lines import Decoded, Piece
from gnss_hil.tools.recording.sequence import Sequencer
from tests.support.feeder import protection
from tests.support.masquerades import FARTHEST_SIGMA
from tests.support.replays import Judge, as_batch

FLAGS = np.array([RTR_FLAG, EFF_FLAG, ERR_FLAG, EFF_FLAG | RTR_FLAG], np.uint32)


@cache
def _crc_table() -> np.ndarray:
    """(256,) of one octet: the CRC of an octet behind zeros is that of the octet by itself."""
    return np.array([protection(0, bytes(7) + bytes([value])) for value in range(256)], np.uint8)


def crc(can_id: np.ndarray, data: np.ndarray) -> np.ndarray:
    """(n,) as `protection`, by a table of it."""
    octets = np.column_stack([can_id & 0xFF, can_id >> 8 & 0xFF, data[:, 1:]]).astype(np.uint8)
    found = np.zeros(len(octets), np.uint8)
    for column in octets.T:
        found = _crc_table()[found ^ column]
    return found


def _random(block: FrameBatch, old: FrameBatch, rng: np.random.Generator) -> FrameBatch:
    can_id, data = rng.integers(0, 0x800, len(block)), rng.integers(0, 256, (len(block), 8))
    return FrameBatch(block.t_ns, can_id.astype(np.uint32), block.length, data.astype(np.uint8))


def _turned(block: FrameBatch, old: FrameBatch, rng: np.random.Generator) -> FrameBatch:
    """One to eight bits of each frame, whichever."""
    order = np.argsort(rng.random((len(block), 64)), axis=1)
    flips = order < rng.integers(1, 9, len(block))[:, None]
    return FrameBatch(block.t_ns, block.can_id, block.length, block.data ^ np.packbits(flips, axis=1))


def _of_before(block: FrameBatch, old: FrameBatch, rng: np.random.Generator) -> FrameBatch:
    return old


def _masqueraded(block: FrameBatch, old: FrameBatch, rng: np.random.Generator) -> FrameBatch:
    """Counter and epoch of a sound frame, its channel as often as not, all else anything."""
    data, kept = block.data.copy(), np.where(rng.random(len(block)) < 0.5, 3, 2)
    data[:, 2:] = np.where(
        np.arange(2, 8) < kept[:, None], data[:, 2:], rng.integers(0, 256, data[:, 2:].shape)
    )
    data[:, 0] = crc(block.can_id, data)
    return FrameBatch(block.t_ns, block.can_id, block.length, data)


def _of_no_contract(block: FrameBatch, old: FrameBatch, rng: np.random.Generator) -> FrameBatch:
    can_id = block.can_id | rng.choice(FLAGS, len(block)) * (rng.random(len(block)) < 0.7)
    length = rng.integers(0, 9, len(block)).astype(block.length.dtype)
    data = np.where(np.arange(8) < length[:, None], block.data, 0).astype(np.uint8)
    return FrameBatch(block.t_ns, can_id.astype(np.uint32), length, data)


Way = Callable[[FrameBatch, FrameBatch, np.random.Generator], FrameBatch]
WAYS: dict[str, Way] = {
    "random": _random,
    "bits turned": _turned,
    "of before": _of_before,
    "right CRC": _masqueraded,
    "no frames of the contract": _of_no_contract,
}


def among(block: FrameBatch, hostile: FrameBatch, rng: np.random.Generator) -> FrameBatch:
    """Both, each in its order, at random places among each other."""
    both = concat([block, hostile])
    order = rng.permutation(np.repeat([0, 1], [len(block), len(hostile)])).astype(bool)
    rows = np.empty(len(both), np.int64)
    rows[~order], rows[order] = np.arange(len(block)), len(block) + np.arange(len(hostile))
    return both[rows]


@dataclass(slots=True)
class Account:
    """What came of it, by consumer."""

    frames: Counter[str] = field(default_factory=Counter)
    told: Counter[str] = field(default_factory=Counter)

    def rows(self) -> Iterator[str]:
        for name, count in self.frames.items():
            own = {what: n for (who, what), n in self.told.items() if who == name}
            yield f"{name:24s} {count:10d} hostile frames  " + ", ".join(f"{n} {w}" for w, n in own.items())


def in_place(block: FrameBatch, rng: np.random.Generator, share: float = 0.02) -> FrameBatch:
    """With bits turned in a share of the frames."""
    struck = rng.random(len(block)) < share
    data = np.where(struck[:, None], _turned(block, block, rng).data, block.data)
    return FrameBatch(block.t_ns, block.can_id, block.length, data)


def _flight(judge: Judge, blocks: Sequence[FrameBatch], way: str, rng, account: Account) -> None:
    state = initial_state(judge.config)
    for number, block in enumerate(blocks):
        hostile = WAYS[way](block, blocks[max(number - int(rng.integers(1, 241)), 0)], rng)
        if way == "bits turned":
            account.told["CRC", "turned frames"] += len(hostile)
            account.told["CRC", "pass it"] += int(
                (crc(hostile.can_id, hostile.data) == hostile.data[:, 0]).sum()
            )
        account.frames[name := f"flight, {way}"] += len(hostile)
        sound = in_place(block, rng) if way == "bits turned" else block
        state, _ = flight_step(judge.config, state, among(sound, hostile, rng))
        fix = state.solution.fix
        if fix is None:
            account.told[name, "epochs without a fix"] += 1
            continue
        error_m = fix.position_m - judge.truth_m[number]
        far = error_m @ np.linalg.solve(fix.covariance_m2, error_m) > FARTHEST_SIGMA**2
        wrong = f"{fix.tested.name} and false" if far else "right fixes"
        account.told[name, wrong] += 1
        if far and fix.tested is Tested.TESTED:
            account.told["flight", "false though tested"] += 1


def _emulator(world, blocks: Sequence[FrameBatch], way: str, rng, account: Account) -> None:
    """As commands: what the flight software might have said, and all that it never says."""
    state, craft = assemble.initial_state(world), world.craft[0].name
    for number, block in enumerate(blocks):
        hostile = WAYS[way](block, blocks[max(number - int(rng.integers(1, 241)), 0)], rng)
        account.frames["emulator"] += len(hostile)
        state, sent, _ = emulate_step(world, state, {craft: hostile}, number)
        account.told["emulator", "epochs played"] += len(sent[craft]) > 0


def _record(blocks: Sequence[FrameBatch], way: str, rng, account: Account, lockstep: bool) -> None:
    """Order, checks and text of what is heard: recorder, report, monitor."""
    contract = codec(4)
    sequencer, screen = Sequencer(contract, lockstep), Screen(contract)
    text = Decoded(Formatter(contract))
    for number, block in enumerate(blocks):
        hostile = WAYS[way](block, blocks[max(number - int(rng.integers(1, 241)), 0)], rng)
        heard = among(block, hostile, rng)
        account.frames["record and monitor"] += len(hostile)
        for epoch in sequencer.hear(heard):
            screen.take(epoch.frames)
            account.told["record and monitor", "epochs on record"] += 1
        text(Piece(0, heard, Screen(contract).take(heard).verdict))


def play(run: Path, frames: int, seed: int, said: Callable[[str], None]) -> Account:
    judge, rng, account = Judge(run), np.random.default_rng(seed), Account()
    blocks = [as_batch(epoch) for epoch in judge.epochs]
    answers = [as_batch(epoch) for epoch in _answers(run / "bus.log")]
    path = run / "scenario.toml"
    given = scenario.parse(scenario.read(path), str(path))
    world = assemble.build_world(given, [load(run / "vehicle.toml")], 7)
    turn, before_kb = 0, 0
    while sum(account.frames.values()) < frames:
        for way in WAYS:
            _flight(judge, blocks, way, rng, account)
            _emulator(world, answers, way, rng, account)
            _record(blocks, way, rng, account, bool(turn % 2))
        now_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        said(f"{sum(account.frames.values())} frames, {now_kb >> 10} MB at most")
        before_kb = before_kb or now_kb
        turn += 1
    said(
        f"memory grew by {now_kb - before_kb >> 10} MB since the first {turn and frames // turn} frames or so"
    )
    return account


def _answers(log: Path) -> list[list[tuple[int, bytes]]]:
    """What the flight software and all others said in each epoch of a bus.log."""
    epochs: list[list[tuple[int, bytes]]] = []
    with log.open() as lines:
        for line in lines:
            name, _, data = line.split()[2].partition("#")
            if int(name, 16) == 0x010:
                epochs.append([])
            epochs[-1].append((int(name, 16), bytes.fromhex(data)))
    return epochs


def send(run: Path, frames: int, seed: int, bus: str) -> int:
    rng, blocks, sent = (
        np.random.default_rng(seed),
        [as_batch(epoch) for epoch in _answers(run / "bus.log")],
        0,
    )
    link = open_link(bus)
    try:
        while sent < frames:
            number = int(rng.integers(len(blocks)))
            way = WAYS[list(WAYS)[int(rng.integers(len(WAYS)))]]
            hostile = way(blocks[number], blocks[max(number - int(rng.integers(1, 241)), 0)], rng)
            link.send(hostile)
            link.receive(0.0)
            sent += len(hostile)
    except LinkClosed as error:
        print(f"{sent} frames sent; then the bus went away: {error}")
        return 0
    print(f"{sent} frames sent")
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--frames", type=int, default=10_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bus", help="embedded:PATH or socketcan:CHANNEL")
    given = parser.parse_args(argv)
    if given.bus:
        return send(given.run, given.frames, given.seed, given.bus)
    account = play(given.run, given.frames, given.seed, lambda line: print(line, file=sys.stderr, flush=True))
    for row in account.rows():
        print(row)
    passed, turned = account.told["CRC", "pass it"], account.told["CRC", "turned frames"]
    print(f"{passed} of {turned} turned frames pass the CRC: 1 in {turned / max(passed, 1):.0f}")
    return int(account.told["flight", "false though tested"] > 0)


if __name__ == "__main__":
    sys.exit(main())
