"""The data that a link stands for: one block, compressed or not, or lists of them; in bounded memory."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from isal import isal_zlib

from gnss_hil.tools.recording.formats.ahead import in_order
from gnss_hil.tools.recording.formats.mf4.blocks import Block, Blocks
from gnss_hil.tools.recording.formats.piece import LogError

SLICE_BYTES = 1 << 22
"""What is read at a time of a block that is not compressed."""
MOST_BYTES = 1 << 29
"""What a compressed block may amount to."""
AHEAD_BYTES = 1 << 25
"""Blocks that amount to more are not inflated before it is their turn: one at a time is in memory."""

_PLAIN = ("##DT", "##SD", "##RD")
_DZ = struct.Struct("<2s2BL2Q")  # of which block, way, -, parameter, bytes before, bytes now
_DEFLATE, _TRANSPOSED = 0, 1


def stretches(blocks: Blocks, at: int, found: list[str], open_end: bool = False) -> Iterator[bytes]:
    """The data, one stretch after the other.

    found     takes what is to be told: data that are not all there
    open_end  the last block of the file may go on to its end, whatever length it has (an unfinished file)
    """
    for part in _parts(blocks, at, found, open_end):
        if len(part) <= 2 * SLICE_BYTES:
            yield part
        else:  # a compressed block of any size; what is made of it takes more room than it does
            for begin in range(0, len(part), SLICE_BYTES):
                yield part[begin : begin + SLICE_BYTES]
            del part  # before the next one is inflated


def _parts(blocks: Blocks, at: int, found: list[str], open_end: bool) -> Iterator[bytes]:
    if not at:
        return
    block = blocks.block(at, *_PLAIN, "##DZ", "##DL", "##HL", "##DV", "##DI", "##LD")
    if block.name == "##HL":
        block = blocks.block(blocks.link(block, 0), "##DL") if blocks.link(block, 0) else None
    if block is None:
        return
    if block.name in ("##DV", "##DI", "##LD"):
        raise LogError(f"{blocks.origin}: has data by columns ({block.name}), which are not read")
    if block.name != "##DL":
        yield from _one(blocks, block, found, open_end)
        return
    links = (link for part in blocks.listed(block.at, "##DL") for link in part.links[1:] if link)
    for parts in in_order(_tasks(blocks, links, found, open_end)):
        yield from parts


def _tasks(
    blocks: Blocks, links: Iterator[int], found: list[str], open_end: bool
) -> Iterator[Callable[[], Iterable[bytes]]]:
    """What gives the stretches of each block; the file is read here, in turn."""
    for link in links:
        block = blocks.block(link, *_PLAIN, "##DZ")
        if block.name == "##DZ":
            blocks.once(block.at, block.name)
            packed = _packed(blocks, block)
            if packed.length <= AHEAD_BYTES:
                yield lambda packed=packed: [_inflated(blocks, packed, found)]
            else:
                yield lambda packed=packed: (_inflated(blocks, packed, found) for _ in range(1))
        else:
            yield lambda block=block: _one(blocks, block, found, open_end)


def _one(blocks: Blocks, block: Block, found: list[str], open_end: bool) -> Iterator[bytes]:
    blocks.once(block.at, block.name)
    if block.name == "##DZ":
        yield _inflated(blocks, _packed(blocks, block), found)
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


@dataclass(frozen=True, slots=True)
class _Packed:
    """A compressed block; missing  bytes of it that are not in the file."""

    where: str
    transposed: bool
    columns: int
    length: int
    octets: bytes
    missing: int


def _packed(blocks: Blocks, block: Block) -> _Packed:
    _, way, _, columns, length, size = blocks.data(block, _DZ)
    where = f"##DZ at byte {block.at}"
    if length > MOST_BYTES:
        raise blocks.fault(
            f"{where} says it amounts to {length} bytes; at most {MOST_BYTES >> 20} MiB are read"
        )
    if way not in (_DEFLATE, _TRANSPOSED):
        raise blocks.fault(f"{where} is compressed in way {way}; known are 0 and 1")
    octets = blocks.bytes(block.body + _DZ.size, min(size, blocks.size))
    blocks.read += len(octets)
    return _Packed(where, way == _TRANSPOSED and columns > 1, columns, length, octets, size - len(octets))


def _inflated(blocks: Blocks, packed: _Packed, found: list[str]) -> bytes:
    try:
        data = isal_zlib.decompressobj().decompress(packed.octets, packed.length + 1)
    except isal_zlib.IsalError as error:  # pyright: ignore[reportGeneralTypeIssues]: its stub is wrong
        raise blocks.fault(f"{packed.where}: {error}") from None
    if packed.missing:
        found.append(f"is cut short: {packed.where} is missing {packed.missing} bytes")
        if packed.transposed:
            return b""  # what is there is of some columns only
    elif len(data) != packed.length:
        amount = "more" if len(data) > packed.length else len(data)
        raise blocks.fault(f"{packed.where} amounts to {amount} bytes of {packed.length}")
    if not packed.transposed:
        return data
    rows = len(data) // packed.columns
    whole = np.frombuffer(data, np.uint8, rows * packed.columns).reshape(packed.columns, rows)
    return whole.T.tobytes() + data[rows * packed.columns :]
