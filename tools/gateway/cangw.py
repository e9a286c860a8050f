"""Faults as rules of the kernel's CAN gateway: what `cangw` of can-utils can do by single frames.

What a fault does to a frame is asked of the faults themselves, by frames of every identifier at its place
whose payloads are drawn: what does the same to the bits of all of them is a rule, everything else is refused.
The protection's CRC is linear, so the kernel computes it: with the data id's part as its beginning.
Source: cangw(1); Linux, net/can/gw.c, which matches a frame with every rule and modifies by AND, XOR, SET.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import U8, Bool
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import IDENTIFIERS
from gnss_hil.dbc.contract.frames import EFF_FLAG, RTR_FLAG, SFF_MASK, WIDTH, FrameBatch, batch
from gnss_hil.dbc.lockstep.messages import is_bench
from gnss_hil.emulator.faults.base import At, Direction
from gnss_hil.emulator.faults.engine import FaultPlan, fresh, inject
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.kinds.row import CANGW
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.emulator.faults.when import When

_DRAWN = 256
_BITS = 11
_EXACT = EFF_FLAG | RTR_FLAG
"""Flags that a filter compares too."""


@dataclass(frozen=True, slots=True)
class Deed:
    """What happens to every frame of an identifier.

    can_id, length  afterwards; length None: as it was
    keep, turn      (8,) bits of the payload: those that stay, then those that are turned over
    crc_turn        CRC recomputed and turned over by these bits; None: it is a byte like the others
    """

    can_id: int
    length: int | None
    keep: bytes
    turn: bytes
    crc_turn: int | None


class _Differs(ValueError):
    """Frames of an identifier do not all fare alike."""


def refusals(plan: FaultPlan, faults: Sequence[Fault], origins: Sequence[str]) -> list[str]:
    """A line for everything that the kernel cannot do of faults, of which a plan has those that can be armed;
    what is refused by the kind alone is told elsewhere.

    origins  of each fault, for people
    """
    armed = {id(one.fault): one for one in plan.armed}
    wrong: list[str] = []
    for fault, origin in zip(faults, origins, strict=True):
        if CANGW not in KINDS[fault.kind].links:
            continue
        found = [*_of_time_and_place(fault)]
        if not found and id(fault) in armed:
            found = _of_deeds(replace(plan, armed=(armed[id(fault)],)))
        wrong += [f"{origin}: {fault.kind}: {one}" for one in found]
    if not wrong and len(plan.armed) == len(faults):
        wrong += [f"together: {one}" for one in _of_deeds(plan)]
    return wrong


def _of_time_and_place(fault: Fault) -> Iterator[str]:
    """What the kernel cannot do of a fault's time and place."""
    if fault.at != When():
        yield "at: cangw knows no time, no number and no chance; without one it acts from the first frame on"
    for key in ("channel", "satellite", "system"):
        if getattr(fault.on, key):
            yield f"on.{key}: cangw tells frames by identifier alone"


def _of_deeds(plan: FaultPlan) -> list[str]:
    """What the kernel cannot do of what faults do together: the first of each reason."""
    found: dict[str, str] = {}
    for way in Direction:
        for can_id in np.flatnonzero(_placed(plan, way)).tolist():
            try:
                deed_of(plan, can_id, way)
            except _Differs as error:
                found.setdefault(str(error), f"0x{can_id:03X}: {error}")
    return list(found.values())


def script(plan: FaultPlan, source: str, sink: str) -> str:
    """Rules that do between two interfaces what the faults do, in shell; `refusals` has found none.

    source   the emulator's interface;  sink  the flight software's
    """
    lines = ["#!/bin/sh", "# Faults by the kernel: modprobe can-gw; `cangw -F` ends them.", "set -e"]
    for way, begin, end in ((Direction.FLIGHT, source, sink), (Direction.RECEIVERS, sink, source)):
        for name in (f"{one.name} ({one.place})" for one in plan.armed if way in one.actions):
            lines.append(f"# {begin} to {end}: {name}")
        lines += [f"cangw -A -s {begin} -d {end} -e {rule}" for rule in _rules(plan, way)]
    return "\n".join(lines) + "\n"


def _placed(plan: FaultPlan, way: Direction) -> Bool:
    """(2048,) identifiers at the places of faults of a direction."""
    placed = np.zeros(IDENTIFIERS, bool)
    for one in plan.armed:
        if way in one.actions:
            placed |= one.where.identifiers
    return placed & ~is_bench(np.arange(IDENTIFIERS, dtype=np.uint32))


def _rules(plan: FaultPlan, way: Direction) -> Iterator[str]:
    """Filters and modifications of a direction: frames that are struck, then all others as they are."""
    placed = _placed(plan, way)
    for can_id in np.flatnonzero(placed).tolist():
        deed = deed_of(plan, can_id, way)
        if deed == _nothing(can_id):
            placed[can_id] = False
        elif deed is not None:
            yield f"-f {can_id:03X}:{_EXACT | SFF_MASK:X}{_modifications(can_id, deed)}"
    yield from (f"-f {value:03X}:{_EXACT | mask:X}" for value, mask in covering(~placed))
    yield f"-f {RTR_FLAG:X}:{RTR_FLAG:X}"
    yield f"-f {EFF_FLAG:X}:{_EXACT:X}"


def _nothing(can_id: int) -> Deed:
    """Frames that come as they are."""
    return Deed(can_id, None, b"\xff" * WIDTH, bytes(WIDTH), None)


def deed_of(plan: FaultPlan, can_id: int, way: Direction) -> Deed | None:
    """What the faults do to every frame of an identifier; None: it does not come. _Differs if they do not all
    fare alike."""
    payload = np.random.default_rng(can_id).integers(0, 256, (_DRAWN, WIDTH), np.uint8)
    payload[:, 1] = payload[:, 1] & 0xF0 | np.arange(_DRAWN) % e2e.COUNTERS
    frames = batch(np.full(_DRAWN, can_id), payload)
    payload[:, 0] = e2e.crc(frames.can_id, payload)
    frames = batch(frames.can_id, payload)
    _, after, _ = inject(plan, fresh(plan), frames, At(0, 0, way))
    if not len(after):
        return None
    if len(after) != _DRAWN or len({*after.can_id.tolist()}) > 1 or len({*after.length.tolist()}) > 1:
        raise _Differs("some frames come and others do not, or they change in different ways")
    length = int(after.length[0])
    keep, turn, same = _bits(frames.data, after.data)
    if not same[:, 1:length].all():
        raise _Differs("the bits change in each frame in its own way; cangw does the same to all")
    crc_turn = None if same[:, 0].all() else _crc_turn(after)
    if crc_turn is not None:
        keep[0], turn[0] = 255, 0
    shortened = None if length == WIDTH else length
    return Deed(int(after.can_id[0]), shortened, keep[:].tobytes(), turn.tobytes(), crc_turn)


def _bits(before: U8, after: U8) -> tuple[U8, U8, Bool]:
    """(8,) bits that stay or are turned over, rather than set; (8,) those turned over, or set to 1; (n, 8)
    where that is so of all bits."""
    turned = before ^ after
    alike = ~np.bitwise_or.reduce(turned ^ turned[0])
    turn = np.where(alike, turned[0] & alike, 0) | after[0] & ~alike
    keep = alike.astype(np.uint8)
    return keep, turn.astype(np.uint8), (before & keep ^ turn) == after


def _crc_turn(after: FrameBatch) -> int:
    """By which bits CRCs differ from the valid ones."""
    turned = {*(after.data[:, 0] ^ e2e.crc(after.can_id, after.data)).tolist()}
    if len(turned) > 1:
        raise _Differs("CRCs that are neither valid nor off by the same bits; cangw can do those alone")
    return turned.pop()


def _modifications(can_id: int, deed: Deed) -> str:
    """Of one rule; the kernel applies them in the order AND, OR, XOR, SET, then computes the CRC."""
    found = ""
    recomputed = deed.crc_turn is not None
    if deed.keep != b"\xff" * WIDTH:
        found += f" -m AND:D:0.0.{deed.keep.hex().upper()}"
    if any(deed.turn) or (recomputed and not found):  # without a modification there is no CRC
        found += f" -m XOR:D:0.0.{deed.turn.hex().upper()}"
    if deed.length is not None or deed.can_id != can_id:
        flags = ("I" if deed.can_id != can_id else "") + ("L" if deed.length is not None else "")
        found += f" -m SET:{flags}:{deed.can_id:03X}.{deed.length or 0:X}.{bytes(WIDTH).hex()}"
    if deed.crc_turn is not None:
        begin = int(e2e.TABLE[e2e.TABLE[deed.can_id & 0xFF] ^ deed.can_id >> 8])
        found += f" -c 1:7:0:{begin:02X}:{deed.crc_turn:02X}:{e2e.TABLE.tobytes().hex().upper()}"
    return found


def covering(wanted: Bool) -> Iterator[tuple[int, int]]:
    """Values and masks that match each wanted (2048,) identifier once and no other: the fewest prefixes."""

    def cover(first: int, bits: int) -> Iterator[tuple[int, int]]:
        some = wanted[first : first + (1 << bits)]
        if some.all():
            yield first, SFF_MASK & ~((1 << bits) - 1)
        elif some.any():
            yield from cover(first, bits - 1)
            yield from cover(first + (1 << bits - 1), bits - 1)

    yield from cover(0, _BITS)
