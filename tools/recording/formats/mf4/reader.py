"""Frames of an MF4 file, whole stretches of it at a time, those of all groups on one time line."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from gnss_hil.tools.recording.formats.mf4.blocks import FIRST, Blocks
from gnss_hil.tools.recording.formats.mf4.frames import frames
from gnss_hil.tools.recording.formats.mf4.groups import DataGroup, data_groups
from gnss_hil.tools.recording.formats.mf4.records import Unfinished, records
from gnss_hil.tools.recording.formats.order import merged
from gnss_hil.tools.recording.formats.piece import Findings, LogError, Piece

_ID = struct.Struct("<8s8s8s4xH30x2H")  # name, version, program, version, undone
_HD = struct.Struct("<Q2h2B")  # start [ns], time zone [min], daylight saving [min], flags, class
_LOCAL_TIME = 1
_COUNTS, _LAST_LENGTH, _OFFSETS = 0x01, 0x04, 0x40
"""Bits of what is undone in an unfinished file: counts of records, last block's length, offsets of values."""


def read(path: Path, found: Findings) -> Iterator[Piece]:
    """The frames of a file; LogError if it is none or where it is damaged."""
    with path.open("rb") as file:
        blocks = Blocks(file, str(path))
        undone = _identify(blocks, found)
        start_us = _start_us(blocks)
        groups = list(data_groups(blocks))
        if not any(group.kind for of in groups for group in of.groups):
            found.remarks.append("has no bus logging of CAN: no channel CAN_DataFrame")
        others = sum(
            group.cycles for of in groups for group in of.groups if not group.kind and not group.vlsd
        )
        if others:
            found.passed["records of other channels"] += others
        streams = [_pieces(blocks, of, undone, start_us, found) for of in groups]
        for piece in merged(streams):
            found.share = min(blocks.read / blocks.size, 1.0)
            yield piece


def _identify(blocks: Blocks, found: Findings) -> Unfinished:
    head = blocks.bytes(0, FIRST)
    if len(head) < FIRST or head[:8] not in (b"MDF     ", b"UnFinMF "):
        begins = head[:8].hex(" ") or "nothing"
        raise LogError(f"{blocks.origin}: not ASAM MDF 4: begins with {begins}, not with MDF")
    name, _, _, version, undone, _ = _ID.unpack(head)
    if not 400 <= version < 500:
        raise LogError(f"{blocks.origin}: is MDF {version / 100:.2f}; 4.00 and newer are read")
    if name == b"MDF     ":
        return Unfinished()
    if undone & _OFFSETS:
        raise LogError(f"{blocks.origin}: is unfinished: where the data of frames are is not in it")
    found.remarks.append("is unfinished: the program that wrote it did not close it; what is there is read")
    return Unfinished(bool(undone & _COUNTS), bool(undone & _LAST_LENGTH))


def _start_us(blocks: Blocks) -> int:
    """UNIX time [us] of the start; local time is taken for what it says where this program runs."""
    start_ns, _, _, flags, _ = blocks.data(blocks.block(FIRST, "##HD"), _HD)
    start_us = (start_ns + 500) // 1000
    if start_us >= 10**17:
        raise blocks.fault(f"a start at {start_ns} ns")
    if not flags & _LOCAL_TIME:
        return start_us
    seconds, micro = divmod(start_us, 1_000_000)
    return int(datetime.fromtimestamp(seconds, UTC).replace(tzinfo=None).timestamp()) * 1_000_000 + micro


def _pieces(
    blocks: Blocks, of: DataGroup, undone: Unfinished, start_us: int, found: Findings
) -> Iterator[Piece]:
    for some, payloads in records(blocks, of, undone, found.remarks):
        yield frames(some, payloads, start_us, blocks.origin, found.omitted)
