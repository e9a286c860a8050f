"""Blocks of an MDF file: 4 bytes of name, 4 unused, u64 length, u64 number of links, links, data.

Whatever a link of a damaged file points to, it is one line that says where and what is there.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

from gnss_hil.tools.recording.formats.piece import LogError

HEAD = struct.Struct("<4s4x2Q")
MOST_LINKS = 1 << 20
MOST_DATA = 1 << 16
"""Links and bytes of a block that describes."""
FIRST = 64
"""Where the block ##HD stands."""


@dataclass(frozen=True, slots=True)
class Block:
    """at      its place in the file
    length  bytes, its head included
    links   places of other blocks, 0 for none
    body    where its data begin
    """

    name: str
    at: int
    length: int
    links: tuple[int, ...]
    body: int


@dataclass(slots=True)
class Blocks:
    """Those of a file; `origin` begins every message.

    size    of the file
    read    bytes of data so far
    """

    file: BinaryIO
    origin: str
    size: int = 0
    read: int = 0
    seen: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.size = os.fstat(self.file.fileno()).st_size

    def fault(self, what: str) -> LogError:
        return LogError(f"{self.origin}: is damaged: {what}")

    def bytes(self, at: int, n: int) -> bytes:
        """n bytes, fewer at the end of the file."""
        self.file.seek(at)
        return self.file.read(n)

    def block(self, at: int, *names: str) -> Block:
        """The block at a place, which has to have one of the names."""
        if not 0 < at <= self.size - HEAD.size:
            raise self.fault(f"a link to byte {at}, of {self.size}, where {' or '.join(names)} has to be")
        name, length, count = HEAD.unpack(self.bytes(at, HEAD.size))
        found = name.decode("latin-1")
        if found not in names:
            raise self.fault(f"{found!r} at byte {at}, where {' or '.join(names)} has to be")
        if count > MOST_LINKS or HEAD.size + 8 * count > max(length, HEAD.size):
            raise self.fault(f"{found} at byte {at} has {count} links in {length} bytes")
        links = self.bytes(at + HEAD.size, 8 * count)
        if len(links) < 8 * count:
            raise self.fault(f"{found} at byte {at} goes beyond the file")
        return Block(found, at, length, struct.unpack(f"<{count}Q", links), at + HEAD.size + 8 * count)

    def data(self, block: Block, layout: struct.Struct) -> tuple:
        """The first data of a block that describes."""
        octets = self.bytes(block.body, layout.size)
        if len(octets) < layout.size or block.body + layout.size > block.at + block.length:
            raise self.fault(f"{block.name} at byte {block.at} has no room for its data")
        return layout.unpack(octets)

    def link(self, block: Block, number: int) -> int:
        """A link of a block, 0 if it has fewer."""
        return block.links[number] if number < len(block.links) else 0

    def listed(self, at: int, name: str) -> Iterator[Block]:
        """The blocks of a list, each of which links to the next one first."""
        while at:
            self.once(at, name)
            block = self.block(at, name)
            yield block
            at = self.link(block, 0)

    def once(self, at: int, name: str) -> None:
        """No block of a list or of data may come twice: the lists of a damaged file may be rings."""
        if at in self.seen:
            raise self.fault(f"{name} at byte {at} is linked to twice")
        self.seen.add(at)

    def text(self, at: int) -> str:
        """The text of a block ##TX or ##MD; "" for none."""
        if not at:
            return ""
        block = self.block(at, "##TX", "##MD")
        octets = self.bytes(block.body, min(max(block.at + block.length - block.body, 0), MOST_DATA))
        return octets.split(b"\0", 1)[0].decode("utf-8", "replace")
