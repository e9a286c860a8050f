"""Files of the program compress (.Z): Lempel-Ziv-Welch codes of 9 to 16 bits.

Every string of the table stands in what is out already: the one before, and the character after it.
Source: S. Thomas et al., compress 4.0 (1985), the program that defines the format; T. Welch, A Technique for
High-Performance Data Compression, Computer 17 (1984)
"""

from __future__ import annotations

START = b"\x1f\x9d"

_NARROWEST, _WIDEST = 9, 16
_WIDTH, _BLOCKS = 0x1F, 0x80
"""Bits of the third byte: widest code; whether code 256 clears the table."""

_CLEAR = 256


def expanded(raw: bytes, largest: int) -> bytes | None:
    """What a .Z file holds; None if that is more than `largest` bytes. ValueError if the data are damaged."""
    if len(raw) < 3 or not _NARROWEST <= raw[2] & _WIDTH <= _WIDEST:
        raise ValueError("not of compress")
    widest, blocks = raw[2] & _WIDTH, bool(raw[2] & _BLOCKS)
    out = bytearray()
    # Place and length in `out` of the strings of codes from 256 on; code 256 is none where it clears.
    begins, lengths = ([0], [0]) if blocks else ([], [])
    width, place, last = _NARROWEST, 3, None
    while place < len(raw):
        # Codes come in eights, which fill as many bytes as a code has bits; where the width changes, the rest
        # of the eight is void.
        group = raw[place : place + width]
        place += width
        bits, mask = int.from_bytes(group, "little"), (1 << width) - 1
        # The last code fills its byte with zeros: other bits left over are the beginning of a code.
        left = 8 * len(group) % width
        if left >= 8 or bits >> 8 * len(group) - left:
            raise ValueError("ends within a code")
        for shift in range(0, 8 * len(group) - width + 1, width):
            code = bits >> shift & mask
            if code == _CLEAR and blocks:
                begins, lengths, width, last = [0], [0], _NARROWEST, None
                break
            begin = len(out)
            if code < 256:
                out.append(code)
            elif code - 256 < len(begins):
                start = begins[code - 256]
                out += out[start : start + lengths[code - 256]]
            elif last is not None and code - 256 == len(begins) < (1 << widest) - 256:
                # The string that is just being made: the one before, and its own first character.
                out += out[last:begin]
                out.append(out[last])
            else:
                raise ValueError("no such code")
            if last is not None and len(begins) < (1 << widest) - 256:
                begins.append(last)
                lengths.append(begin - last + 1)
            last = begin
            if len(out) > largest:
                return None
            if 256 + len(begins) > mask and width < widest:
                width += 1
                break
    return bytes(out)
