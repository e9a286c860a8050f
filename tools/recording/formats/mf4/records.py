"""The records of a data group: group by group as they come, with the payloads that belong to them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.tools.recording.formats.mf4.blocks import Blocks
from gnss_hil.tools.recording.formats.mf4.data import stretches
from gnss_hil.tools.recording.formats.mf4.frames import Payloads, Records, fixed_payloads, integers
from gnss_hil.tools.recording.formats.mf4.groups import VLSD, DataGroup, Group
from gnss_hil.tools.recording.formats.mf4.variable import LENGTH_BYTES, Values, lengths

MOST_VALUE = 1 << 26
"""No value of variable length is longer."""

Heard = tuple[Records, Payloads]


@dataclass(frozen=True, slots=True)
class Unfinished:
    """What the program that wrote a file left undone: counts of records, the last data's length."""

    counts: bool = False
    last_length: bool = False


def records(blocks: Blocks, of: DataGroup, undone: Unfinished, found: list[str]) -> Iterator[Heard]:
    """Records of frames, and their payloads; what is not all there is told in `found`."""
    data = stretches(blocks, of.data, found, undone.last_length)
    if of.id_bytes:
        yield from _unsorted(blocks, of, data, undone, found)
    elif of.groups and of.groups[0].kind:
        yield from _sorted(blocks, of.groups[0], data, undone, found)


def _sorted(
    blocks: Blocks, group: Group, data: Iterator[bytes], undone: Unfinished, found: list[str]
) -> Iterator[Heard]:
    values = _values_elsewhere(blocks, group, undone, found)
    done, rest = 0, b""
    for part in data:
        part = rest + part if rest else part
        n = len(part) // group.size
        n = n if undone.counts else min(n, group.cycles - done)
        some = Records(part[: n * group.size], group, done)
        rest, done = part[n * group.size :], done + n
        if n:
            yield some, _payloads(some, values)
        if not undone.counts and done == group.cycles:
            if len(rest) >= group.size or next(data, None):
                found.append(
                    f"has more data of {group.kind} than its {so_many(group.cycles, 'record')}, "
                    "which are not read"
                )
            return
    _tell_missing(group, done, undone, found)


def _tell_missing(group: Group, done: int, undone: Unfinished, found: list[str]) -> None:
    if not undone.counts and done < group.cycles:
        found.append(f"is cut short: {group.kind} has {done} of {so_many(group.cycles, 'record')}")


def _values_elsewhere(blocks: Blocks, group: Group, undone: Unfinished, found: list[str]) -> Values | None:
    """The data of a channel of variable length that lie in a block of their own; None if there are none."""
    channel = group.channels.get("DataBytes")
    if channel is None or channel.kind != VLSD:
        return None
    return Values(blocks.origin, stretches(blocks, channel.data, found, undone.last_length))


def _payloads(some: Records, values: Values | None) -> Payloads:
    return fixed_payloads(some) if values is None else values.payloads(_offsets(some))


def _offsets(some: Records) -> NDArray[np.int64]:
    return np.clip(integers(some, some.group.channels["DataBytes"]), 0, 2**62)


@dataclass(slots=True)
class _Lane:
    """A group of frames among others.

    waiting  records whose payloads have not come yet
    """

    group: Group
    values: Values | None
    done: int = 0
    waiting: bytes = field(default=b"", repr=False)


def _unsorted(
    blocks: Blocks, of: DataGroup, data: Iterator[bytes], undone: Unfinished, found: list[str]
) -> Iterator[Heard]:
    """Records with identifiers before them; values of variable length may be records of their own."""
    shared = {group.at: Values(blocks.origin) for group in of.groups if group.vlsd}
    lanes = {}
    for group in of.groups:
        if group.kind:
            channel = group.channels.get("DataBytes")
            values = shared.get(channel.data) if channel is not None and channel.kind == VLSD else None
            lanes[group.record] = _Lane(group, values or _values_elsewhere(blocks, group, undone, found))
    if not lanes:
        return
    values_of = {group.record: shared[group.at] for group in of.groups if group.vlsd}
    sizes = {group.record: group.size for group in of.groups if not group.vlsd}
    if max(sizes.values(), default=0) > MOST_VALUE:
        raise blocks.fault(f"records of {max(sizes.values())} bytes")
    rest = b""
    for part in data:
        part = rest + part if rest else part
        place, number, end, strange = _places(part, of.id_bytes, sizes, values_of, blocks)
        if strange is not None and not undone.last_length:
            raise blocks.fault(f"a record of identifier {strange}, which no group has")
        rest = part[end:]
        raw = np.frombuffer(part, np.uint8)
        for record, values in values_of.items():
            _collect(raw, part, place[number == record] + of.id_bytes, values)
        for record, lane in lanes.items():
            rows = place[number == record] + of.id_bytes
            octets = lane.waiting + raw[rows[:, None] + np.arange(lane.group.size)].tobytes()
            yield from _ready(lane, octets, last=False)
        if strange is not None:  # where the last data of an unfinished file end is not known otherwise
            break
    for lane in lanes.values():
        yield from _ready(lane, lane.waiting, last=True)
        _tell_missing(lane.group, lane.done, undone, found)
    if rest.strip(b"\0"):
        found.append(f"is cut short: the last record is missing bytes, {len(rest)} are there")


def _places(
    part: bytes, id_bytes: int, sizes: dict[int, int], values_of: dict[int, Values], blocks: Blocks
) -> tuple[NDArray[np.int64], NDArray[np.uint64], int, int | None]:
    """Places and identifiers of the records, where one not whole begins, an identifier of no group."""
    step_of = {number: size + id_bytes for number, size in sizes.items()} | dict.fromkeys(values_of, 0)
    length_at, before = struct.Struct("<L").unpack_from, id_bytes + LENGTH_BYTES
    n, at, strange = len(part), 0, None
    places: list[int] = []
    add = places.append
    try:
        while at + id_bytes <= n:
            number = part[at] if id_bytes == 1 else int.from_bytes(part[at : at + id_bytes], "little")
            step = step_of[number]
            if not step:
                step = before + length_at(part, at + id_bytes)[0]
                if step > MOST_VALUE:
                    raise blocks.fault(f"a value of {step - before} bytes among the records")
            add(at)
            at += step
    except KeyError as unknown:
        strange = unknown.args[0]
    except struct.error:  # the length is not whole
        pass
    if at > n:  # the last one is not whole
        at = places.pop()
    place = np.array(places, np.int64)
    octets = np.frombuffer(part, np.uint8)
    number = np.zeros(len(place), np.uint64)
    for i in range(id_bytes):
        number |= octets[place + i].astype(np.uint64) << np.uint64(8 * i)
    return place, number, at, strange


def _collect(raw: NDArray[np.uint8], part: bytes, begin: NDArray[np.int64], values: Values) -> None:
    """Put values of variable length one behind the other, each with its length before it."""
    if not len(begin):
        return
    size = LENGTH_BYTES + lengths(raw, begin)
    if (size == size[0]).all():
        values.add(raw[begin[:, None] + np.arange(size[0])].tobytes())
    else:
        values.add(
            b"".join([part[a:b] for a, b in zip(begin.tolist(), (begin + size).tolist(), strict=True)])
        )


def _ready(lane: _Lane, octets: bytes, last: bool) -> Iterator[Heard]:
    """The records whose payloads are there; at the end all of them."""
    some = Records(octets, lane.group, lane.done)
    lane.waiting = b""
    n = len(some)
    if not n:
        return
    if lane.values is None:
        lane.done += n
        yield some, fixed_payloads(some)
        return
    payloads = lane.values.payloads(_offsets(some))
    if payloads.missing.any() and not last:
        n = int(payloads.missing.argmax())
        lane.waiting = octets[n * lane.group.size :]
        payloads = Payloads(payloads.data[:n], payloads.length[:n], payloads.missing[:n])
        some = Records(octets[: n * lane.group.size], lane.group, lane.done)
    lane.done += n
    if n:
        yield some, payloads
