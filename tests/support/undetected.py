"""Corruptions of a frame that Profile 11's CRC-8 does not see, all of them.

The CRC is linear: whether a pattern of flipped bits is seen depends on the pattern alone, not on payload and
identifier. A bit's syndrome is what it makes of the difference between the CRC sent and the one worked out; a
pattern is not seen if the syndromes of its bits cancel. Worked out here by a register of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import combinations
from math import comb

import numpy as np

from gnss_hil.dbc.contract.frames import FrameBatch

PAYLOAD_BITS, IDENTIFIER_BITS = 64, 11
HEADER_BITS = 16
"""CRC, counter and epoch: what the measurements are not in."""

_POLYNOMIAL = 0x11D


def _remainder(bits_behind: int) -> int:
    """Of one set bit with so many behind it in the CRC's message."""
    register = 1
    for _ in range(8 + bits_behind):
        register <<= 1
        if register & 0x100:
            register ^= _POLYNOMIAL
    return register


@cache
def syndromes() -> np.ndarray:
    """(75,) uint8 of payload bits (bit k: byte k // 8, value 1 << k % 8), then of identifier bits, low first.

    The message is the identifier's low byte, its high byte and bytes 1 to 7, most significant bits first; the
    CRC in byte 0 is compared with the remainder.
    """
    crc = [1 << k for k in range(8)]
    payload = [_remainder(8 * (7 - k // 8) + k % 8) for k in range(8, PAYLOAD_BITS)]
    identifier = [_remainder(8 * (8 - k // 8) + k % 8) for k in range(IDENTIFIER_BITS)]
    return np.array(crc + payload + identifier, np.uint8)


def patterns(bits: int, of: int = PAYLOAD_BITS) -> np.ndarray:
    """(comb(of, bits), bits) all choices of so many of the first bits."""
    flat = np.fromiter((k for chosen in combinations(range(of), bits) for k in chosen), np.uint8)
    return flat.reshape(comb(of, bits), bits)


@cache
def undetected(bits: int, of: int = PAYLOAD_BITS) -> np.ndarray:
    """(k, bits) all patterns of so many flipped bits that the CRC does not see; `of`: PAYLOAD_BITS, or those
    and the identifier's."""
    every = patterns(bits, of)
    return every[np.bitwise_xor.reduce(syndromes()[every], axis=1) == 0]


def behind_the_header(found: np.ndarray) -> np.ndarray:
    """Those patterns (k, bits) that leave CRC, counter and epoch as they are: no other check of the frame
    sees them either."""
    return found[(found >= HEADER_BITS).all(axis=1)]


def masks(found: np.ndarray) -> np.ndarray:
    """(k, 8) uint8 to be XORed onto payloads, of patterns (k, bits) of payload bits."""
    words = np.bitwise_or.reduce(np.uint64(1) << found.astype(np.uint64), axis=1)
    return words.astype("<u8").view(np.uint8).reshape(-1, 8)


def wire_bursts(length: int) -> np.ndarray:
    """(k, 8) uint8 masks of all bursts of so many payload bits, in the order of the wire: byte 0 first, most
    significant bit first; the first and the last bit are flipped, those between in every way."""
    inner = max(length - 2, 0)
    burst = [(1 << length - 1 | between << 1 | 1) if length > 1 else 1 for between in range(1 << inner)]
    words = [b << shift for b in burst for shift in range(PAYLOAD_BITS - length + 1)]
    return np.array(words, ">u8").view(np.uint8).reshape(-1, 8)


def corrupted(block: FrameBatch, row: int) -> Iterator[FrameBatch]:
    """The block with its frame of one row corrupted by each pattern of three, then of four bits that no check
    of the frame sees."""
    for bits in (3, 4):
        for mask in masks(behind_the_header(undetected(bits))):
            data = block.data.copy()
            data[row] ^= mask
            yield FrameBatch(block.t_ns, block.can_id, block.length, data)
