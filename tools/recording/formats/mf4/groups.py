"""Channel groups of a file: how the records of frames of CAN are laid out."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace

from gnss_hil.tools.recording.formats.mf4.blocks import FIRST, Block, Blocks
from gnss_hil.tools.recording.formats.piece import LogError

_DG = struct.Struct("<B7x")
_CG = struct.Struct(
    "<2Q2H4x2L"
)  # record's identifier, cycles, flags, separator, bytes of data, of invalidation
_CN = struct.Struct("<4B4LB")  # type, -, data's type, bit; byte, bits, flags, bit of invalidation; precision
_CC = struct.Struct("<2B3H2d")  # type, precision, flags, references, values; range
_VLSD_GROUP = 1
_ALL_INVALID, _MAY_BE_INVALID = 1, 2
FIXED, VLSD, MASTER, VIRTUAL_MASTER, MLSD = 0, 1, 2, 3, 5
"""Types of channels."""
FLOAT_LE, FLOAT_BE = 4, 5
BIG_ENDIAN = (1, 3, 5)
SIGNED = (2, 3)
TEXT = (6, 7)
"""Types of data."""
_LINEAR = 1
FRAMES = ("CAN_DataFrame", "CAN_ErrorFrame", "CAN_RemoteFrame")
_MOST_DEPTH = 8
MOST_RECORD = 1 << 20
"""No record of frames is longer."""


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel of a record.

    byte, bit, bits  where it lies
    invalid  bit behind the record's data that tells whether the value is none; None: it always is one
    offset, factor   of the physical value
    data     link to what of it lies elsewhere
    """

    name: str
    kind: int
    type: int
    byte: int
    bit: int
    bits: int
    invalid: int | None
    never: bool
    offset: float
    factor: float
    data: int
    at: int


@dataclass(frozen=True, slots=True)
class Group:
    """A channel group.

    kind      of frame, "" for a group of anything else
    record    its identifier; cycles: how many there are
    size      bytes of a record, those of invalidation included, not those of the identifier
    time      the master channel; channels: the others of a frame, by their short names
    vlsd      it is the data of variable length of a channel of another group
    """

    kind: str
    at: int
    record: int
    cycles: int
    size: int
    valued: int
    time: Channel | None
    channels: dict[str, Channel]
    vlsd: bool


@dataclass(frozen=True, slots=True)
class DataGroup:
    """Groups whose records lie one among the other.

    id_bytes  of the identifier before each record, 0 if there is none
    data      link to the records
    """

    id_bytes: int
    data: int
    groups: tuple[Group, ...]


def data_groups(blocks: Blocks) -> Iterator[DataGroup]:
    """Those of a file."""
    head = blocks.block(FIRST, "##HD")
    for block in list(blocks.listed(blocks.link(head, 0), "##DG")):
        (id_bytes,) = blocks.data(block, _DG)
        if id_bytes not in (0, 1, 2, 4, 8):
            raise blocks.fault(f"##DG at byte {block.at} has record identifiers of {id_bytes} bytes")
        groups = tuple(_group(blocks, group) for group in blocks.listed(blocks.link(block, 1), "##CG"))
        if not id_bytes and len(groups) > 1:
            raise blocks.fault(f"##DG at byte {block.at} has {len(groups)} groups and no record identifiers")
        yield DataGroup(id_bytes, blocks.link(block, 2), groups)


def _group(blocks: Blocks, block: Block) -> Group:
    record, cycles, flags, _, valued, invalid = blocks.data(block, _CG)
    if flags & _VLSD_GROUP:
        return Group("", block.at, record, cycles, 0, 0, None, {}, True)
    channels = list(_channels(blocks, blocks.link(block, 1), 0))
    kind = next((c.name for c in channels if c.name in FRAMES), "")
    size = valued + invalid
    if kind and not 0 < size <= MOST_RECORD:
        raise blocks.fault(f"##CG at byte {block.at} has records of {size} bytes")
    time = next((c for c in channels if c.kind in (MASTER, VIRTUAL_MASTER)), None)
    named = {c.name.removeprefix(f"{kind}."): c for c in channels}
    group = Group(kind, block.at, record, cycles, size, valued, time, named if kind else {}, False)
    if kind:
        _check(blocks, group, invalid)
    return group


def _channels(blocks: Blocks, at: int, depth: int) -> Iterator[Channel]:
    """The channels of a list and those that they are made of."""
    for block in blocks.listed(at, "##CN"):
        channel = _channel(blocks, block)
        yield channel
        parts = blocks.link(block, 1)
        if parts and depth < _MOST_DEPTH and blocks.block(parts, "##CN", "##CA").name == "##CN":
            yield from _channels(blocks, parts, depth + 1)


def _channel(blocks: Blocks, block: Block) -> Channel:
    kind, _, data_type, bit, byte, bits, flags, invalid, _ = blocks.data(block, _CN)
    offset, factor = _conversion(blocks, blocks.link(block, 4), kind)
    return Channel(
        blocks.text(blocks.link(block, 2)), kind, data_type, byte, bit, bits,
        invalid if flags & _MAY_BE_INVALID else None, bool(flags & _ALL_INVALID), offset, factor,
        blocks.link(block, 5), block.at,
    )  # fmt: skip


def _conversion(blocks: Blocks, at: int, kind: int) -> tuple[float, float]:
    """Offset and factor; conversions to text leave a number as it is, which is what is wanted."""
    if not at:
        return 0.0, 1.0
    block = blocks.block(at, "##CC")
    found, _, _, _, values, _, _ = blocks.data(block, _CC)
    if found == _LINEAR and values >= 2:
        linear = replace(block, body=block.body + _CC.size)
        return blocks.data(linear, struct.Struct("<2d"))
    if found and kind in (MASTER, VIRTUAL_MASTER):
        raise blocks.fault(f"##CC at byte {at}: times by a conversion of type {found} are not read")
    return 0.0, 1.0


def _check(blocks: Blocks, group: Group, invalid_bytes: int) -> None:
    """Every channel that is read has to lie in the record."""
    used = [group.channels[name] for name in (group.kind, *MEMBERS) if name in group.channels]
    for channel in [*used, *([group.time] if group.time else [])]:
        end = channel.byte + (channel.bit + channel.bits + 7) // 8
        inside = channel.kind == VIRTUAL_MASTER or end <= group.valued
        marked = channel.invalid is None or channel.invalid < 8 * invalid_bytes
        if not inside or not marked or channel.bit > 7:
            raise blocks.fault(f"channel {channel.name} at byte {channel.at} does not lie in its record")
        if channel.kind == VLSD and channel.bits not in (32, 64):
            raise blocks.fault(
                f"channel {channel.name} at byte {channel.at} has offsets of {channel.bits} bits"
            )
    if group.time is None:
        raise LogError(f"{blocks.origin}: {group.kind} at byte {group.at} has no channel of time")


MEMBERS = ("BusChannel", "ID", "IDE", "DLC", "DataLength", "DataBytes", "Dir", "EDL", "RTR")
"""What is read of a frame."""
