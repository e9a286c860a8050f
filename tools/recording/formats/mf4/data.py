"""The data that a link stands for: one block, compressed or not, or lists of them; in bounded memory."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import numpy as np

from gnss_hil.tools.recording.formats.mf4.blocks import Block, Blocks

SLICE_BYTES = 1 << 22
"""What is read at a time of a block that is not compressed."""
MOST_BYTES = 1 << 29
"""What a compressed block may amount to."""

_PLAIN = ("##DT", "##SD", "##RD")
_DZ = struct.Struct("<2s2BL2Q")  # of which block, way, -, parameter, bytes before, bytes now
_DEFLATE, _TRANSPOSED = 0, 1


def stretches(blocks: Blocks, at: int, found: list[str], open_end: bool = False) -> Iterator[bytes]:
    """The data, one stretch after the other.

    found     takes what is to be told: data that are not all there
    open_end  the last block of the file may go on to its end, whatever length it has (an unfinished file)
    """
    if not at:
        return
    block = blocks.block(at, *_PLAIN, "##DZ", "##DL", "##HL", "##DV", "##DI", "##LD")
    if block.name == "##HL":
        block = blocks.block(blocks.link(block, 0), "##DL") if blocks.link(block, 0) else None
    if block is None:
        return
    if block.name in ("##DV", "##DI", "##LD"):
        raise blocks.fault(f"{block.name} at byte {block.at}: data by columns are not read")
    if block.name != "##DL":
        yield from _one(blocks, block, found, open_end)
        return
    for part in blocks.listed(block.at, "##DL"):
        for link in part.links[1:]:
            if link:
                yield from _one(blocks, blocks.block(link, *_PLAIN, "##DZ"), found, open_end)


def _one(blocks: Blocks, block: Block, found: list[str], open_end: bool) -> Iterator[bytes]:
    blocks.once(block.at, block.name)
    if block.name == "##DZ":
        yield _inflated(blocks, block, found)
        return
    length = max(block.at + block.length - block.body, 0)
    if open_end and (length == 0 or block.at + block.length > blocks.size):
        length = blocks.size - block.body
    at, end = block.body, block.body + length
    while at < end:
        part = blocks.bytes(at, min(SLICE_BYTES, end - at))
        if not part:
            found.append(f"is cut short: {block.name} at byte {block.at} is missing {end - at} bytes")
            return
        at += len(part)
        blocks.read += len(part)
        yield part


def _inflated(blocks: Blocks, block: Block, found: list[str]) -> bytes:
    _, way, _, columns, length, packed = blocks.data(block, _DZ)
    where = f"##DZ at byte {block.at}"
    if length > MOST_BYTES:
        raise blocks.fault(
            f"{where} says it amounts to {length} bytes; at most {MOST_BYTES >> 20} MiB are read"
        )
    if way not in (_DEFLATE, _TRANSPOSED):
        raise blocks.fault(f"{where} is compressed in way {way}; known are 0 and 1")
    octets = blocks.bytes(block.body + _DZ.size, min(packed, blocks.size))
    inflate = zlib.decompressobj()
    try:
        data = inflate.decompress(octets, length + 1)
    except zlib.error as error:
        raise blocks.fault(f"{where}: {error}") from None
    blocks.read += len(octets)
    if len(octets) < packed:
        found.append(f"is cut short: {where} is missing {packed - len(octets)} bytes")
        if way == _TRANSPOSED:
            return b""  # what is there is of some columns only
    elif len(data) != length:
        raise blocks.fault(
            f"{where} amounts to {'more' if len(data) > length else len(data)} bytes of {length}"
        )
    if way == _DEFLATE or columns < 2:
        return data
    rows = len(data) // columns
    whole = np.frombuffer(data, np.uint8, rows * columns).reshape(columns, rows)
    return whole.T.tobytes() + data[rows * columns :]
