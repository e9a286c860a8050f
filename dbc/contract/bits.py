"""Exact length of classical CAN frames on the wire, stuff bits included.

Source: ISO 11898-1: a stuff bit follows five equal bits from start of frame to the CRC; CRC-15
polynomial 0x4599. Walking 98 bits per frame is slow in arrays, so the stuffing automaton (last bit,
run length) and the CRC are tabulated per byte.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import SFF_MASK, WIDTH, FrameBatch

TRAILER_BITS = 13
"""CRC delimiter, acknowledge slot and delimiter, end of frame (7) and intermission (3)."""

_POLYNOMIAL = 0x4599
_START = 0  # state before the first bit: no run yet
# State 1 + 5 * bit + (run - 1): the last bit and how many equal ones in a row, 1 to 5; 5 means that a
# stuff bit is due before the next bit.
_STATES = 11


def _step(state: NDArray, bit: NDArray) -> tuple[NDArray, NDArray]:
    """Next automaton state after sending `bit`, and the stuff bits (0 or 1) sent before it."""
    last, run = (state - 1) // 5, (state - 1) % 5 + 1
    begun = state != _START
    stuffed = begun & (run == 5)
    last = np.where(stuffed, 1 - last, last)
    run = np.where(stuffed, 1, run)
    run = np.where(begun & (bit == last), run + 1, 1)
    return 1 + 5 * bit + run - 1, stuffed.astype(np.int64)


@cache
def _stretch(bits: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """(11, 2^bits) state after sending a word of a few bits from each state, and the stuff bits sent."""
    state, word = np.broadcast_arrays(np.arange(_STATES)[:, None], np.arange(1 << bits))
    stuffed = np.zeros(state.shape, np.int64)
    for k in reversed(range(bits)):
        state, sent = _step(state, word >> k & 1)
        stuffed += sent
    return state.astype(np.uint8), stuffed.astype(np.uint8)


def _walk(state: NDArray, word: NDArray, bits: int) -> tuple[NDArray, NDArray]:
    """State after sending the bits of a word, msb first, and the stuff bits sent; arrays broadcast."""
    stuffed = np.uint8(0)
    for low in reversed(range(0, bits, 8)):
        width = min(8, bits - low)
        after, sent = _stretch(width)
        piece = word >> low & (1 << width) - 1
        stuffed = stuffed + sent[state, piece]
        state = after[state, piece]
    return state, np.asarray(stuffed)


def _crc15(crc: NDArray, word: NDArray, bits: int) -> NDArray:
    for k in reversed(range(bits)):
        feedback = (word >> k & 1) ^ (crc >> 14)
        crc = (crc << 1 & 0x7FFF) ^ np.where(feedback, _POLYNOMIAL, 0)
    return crc


@cache
def _tables():
    # SOF (0), identifier, RTR (0), IDE (0), r0 (0), DLC: row identifier << 4 | length.
    rows = np.arange(1 << 15)
    header = rows >> 4 << 7 | rows & 15
    states = np.arange(_STATES)[:, None]
    header_state, header_stuff = _walk(np.array(_START), header, 19)
    byte_state, byte_stuff = _stretch(8)
    byte_step = byte_state | byte_stuff << 4  # both in one look-up
    crc_state, crc_stuff = _walk(states, np.arange(1 << 15), 15)
    # A stuff bit due after the last CRC bit is still sent.
    crc_stuff = crc_stuff + ((crc_state - 1) % 5 == 4)
    return (
        header_state,
        header_stuff,
        _crc15(np.zeros_like(header), header, 19),
        byte_step,
        _crc15(np.zeros(256, np.int64), np.arange(256), 8),
        crc_stuff,
    )


def frame_bits(frames: FrameBatch) -> NDArray[np.int64]:
    """(n,) bits each base-format data frame occupies, intermission included (8 bytes: 111 + stuff bits)."""
    header_state, header_stuff, header_crc, byte_step, byte_crc, crc_stuff = _tables()
    length = frames.length.astype(np.int64)
    header = (frames.can_id & SFF_MASK).astype(np.int64) << 4 | length
    state = header_state[header]
    stuffed = header_stuff[header]
    crc = header_crc[header]
    shortest = int(length.min(initial=WIDTH))
    for k in range(int(length.max(initial=0))):
        byte = frames.data[:, k]
        step = byte_step[state, byte]
        after = (crc << 8 & 0x7FFF) ^ byte_crc[crc >> 7 ^ byte]
        if k >= shortest:
            sent = k < length
            step, after = np.where(sent, step, state), np.where(sent, after, crc)
        state, crc = step & 15, after
        stuffed += step >> 4
    return 34 + 8 * length + stuffed + crc_stuff[state, crc] + TRAILER_BITS
