"""One event of an ASC file, of whatever kind. What most lines are goes whole chunks at a time: `lines`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG, WIDTH
from gnss_hil.tools.recording.formats.asc.lines import MOST_S
from gnss_hil.tools.recording.formats.piece import CUT, FD, XL

TIME = re.compile(rb"\s*([+-]?)(\d{1,10})(?:[.,](\d{1,12}))?(?=\s)")
_NUMBER = {16: re.compile(r"[0-9A-Fa-f]{1,9}$"), 10: re.compile(r"[0-9]{1,9}$")}
_CHANNEL = re.compile(r"[0-9]{1,5}$")
_NAMED_ID = re.compile(r"\bID = ([0-9]{1,10})(x?)")
_EDL, _REMOTE = 0x1000, 0x10
"""Bits of the flags of a CANFD event (can-utils, asc2log.c); EDL: the frame is one of CAN FD."""
_FD_WORDS, _XL_WORDS = re.compile(r"[01] [01] [0-9A-Fa-f] [0-9]{1,2} "), re.compile(r"[0-9A-Fa-f] [0-9] ")
_DIRECTIONS = ("rx", "tx")
UNNAMED = "with a name instead of an identifier"

_OTHERS = (
    (re.compile(r"start (of|der|de) |log (trigger|direct)|measurement"), ""),
    (re.compile(r"\d+ statistic|statistic"), "statistics"),
    (re.compile(r"can \d+ status"), "states of controllers"),
    (re.compile(r"\d+ overloadframe"), "overload frames"),
    (re.compile(r"\d+ j1939tp"), "J1939 transports"),
    (re.compile(r"sv: "), "system variables"),
    (re.compile(r"\S+ := "), "environment variables"),
    (re.compile(r"comment"), "comments"),
    (re.compile(r"gmr|global ?marker"), "markers"),
    (re.compile(r"gps"), "GPS positions"),
    (re.compile(r"tfs"), "test steps"),
    (re.compile(r"(l\d+|li) "), "events of LIN"),
    (re.compile(r"fr "), "events of FlexRay"),
    (re.compile(r"(eth|ethernet|afdx|wlan|most|mts|mt|a429|kline|sxi) "), "events of other buses"),
)
"""What is no frame of CAN, by its words behind the time: pattern of small letters, and what it is called."""

UNKNOWN = "unknown lines"


@dataclass(frozen=True, slots=True)
class Frame:
    """channel from 0; data of any length, of which a remote frame has none"""

    channel: int
    can_id: int
    length: int
    data: bytes = b""
    sent: bool = False


@dataclass(frozen=True, slots=True)
class Omitted:
    """A frame that is left out, and why."""

    why: str


Event = Frame | Omitted | str
"""A frame, one that is left out, or the kind of event; "" for what every file has."""


def time_ns(line: bytes) -> int | None:
    """The time before an event, None if there is none."""
    match = TIME.match(line)
    if match is None:
        return None
    sign, whole, fraction = match.groups()
    if int(whole) >= MOST_S:
        return None
    ns = int(whole) * 10**9 + int((fraction or b"0").ljust(9, b"0")[:9])
    return -ns if sign == b"-" else ns


def event(text: str, base: int) -> Event:
    """What stands behind a time."""
    words = text.split()
    small = " ".join(words).lower()
    if small.startswith("canfd "):
        found = _fd(words[1:], base)
    elif small.startswith("canxl "):
        found = _xl(words[1:])
    elif re.match(r"[0-9]{1,5} \S+ (rx|tx|txrq)( |$)", small):
        found = _classic(words, text, base)
    elif re.match(r"[0-9]{1,5} errorframe", small):
        found = Frame(int(words[0]) - 1, ERR_FLAG, 0)
    else:
        found = None
    if found is None:
        return next((kind for pattern, kind in _OTHERS if pattern.match(small)), UNKNOWN)
    if isinstance(found, Frame) and not -1 <= found.channel < 2**16:
        return UNKNOWN
    return found


def _identifier(word: str, base: int) -> int | None:
    extended = word[-1:] in "xX"
    digits = word[:-1] if extended else word
    if not _NUMBER[base].match(digits):
        return None
    number = int(digits, base)
    if number > EFF_MASK:
        return None
    return number | EFF_FLAG if extended else number


def _payload(words: list[str], length: int, base: int) -> bytes | None:
    """The bytes of a payload, None if not all are there."""
    found = words[:length]
    if len(found) < length or not all(_NUMBER[base].match(w) and int(w, base) < 256 for w in found):
        return None
    return bytes(int(w, base) for w in found)


def _classic(words: list[str], text: str, base: int) -> Event | None:
    """channel, identifier, direction, d or r, length (a remote frame may have none), bytes ..."""
    channel, name, direction, *rest = words
    if direction.lower() not in _DIRECTIONS:
        return "requests to send"
    if not rest or rest[0].lower() not in ("d", "r"):
        return None
    can_id = _identifier(name, base)
    if can_id is None:
        numeric = _NAMED_ID.search(text)
        if numeric is None or int(numeric[1]) > EFF_MASK:
            return Omitted(UNNAMED)
        can_id = int(numeric[1]) | (EFF_FLAG if numeric[2] else 0)
    length = int(rest[1], 16) if len(rest) > 1 and re.match(r"0?[0-9A-Fa-f]$", rest[1]) else None
    sent = direction.lower() == "tx"
    if rest[0].lower() == "r":
        return Frame(int(channel) - 1, can_id | RTR_FLAG, min(length or 0, WIDTH), sent=sent)
    if length is None:
        return Omitted(CUT)
    data = _payload(rest[2:], min(length, WIDTH), base)
    return Omitted(CUT) if data is None else Frame(int(channel) - 1, can_id, len(data), data, sent)


def _place(words: list[str], candidates: tuple[int, int], pattern: re.Pattern[str]) -> int | None:
    """Where the numbers before a payload begin: there may be a name before them."""
    return next((i for i in candidates if pattern.match(" ".join(words[i : i + 5]) + " ")), None)


def _fd(words: list[str], base: int) -> Event | None:
    """channel, direction, identifier, perhaps a name, BRS, ESI, DLC, length, bytes, duration, bits, flags

    CANoe writes classical frames of an FD channel so too: their flags have no EDL.
    """
    if len(words) < 3 or not _CHANNEL.match(words[0]):
        return None
    channel, sent = int(words[0]) - 1, words[1].lower() == "tx"
    if "errorframe" in (word.lower() for word in words[1:3]):
        return Frame(channel, ERR_FLAG, 0, sent=sent)
    if words[1].lower() not in _DIRECTIONS:
        return "requests to send" if words[1].lower() == "txrq" else None
    at = next(
        (i for i in (3, 4) if re.match(r"[01] [01] [0-9A-Fa-f] \d{1,2}$", " ".join(words[i : i + 4]))), None
    )
    if at is None:
        return Omitted(CUT)
    dlc, length = int(words[at + 2], 16), int(words[at + 3])
    rest = words[at + 4 + length :]
    flags = int(rest[2], 16) if len(rest) > 2 and _NUMBER[16].match(rest[2]) else _EDL
    if flags & _EDL:
        return Omitted(FD)
    data = words[at + 4 : at + 4 + length]
    if base == 10 and any(re.search("[a-fA-F]", word) for word in (*data, words[2].rstrip("xX"))):
        base = 16  # can-utils found these events in hexadecimal in files of either base
    remote = bool(flags & _REMOTE) or (dlc > 0 and length == 0)
    return _switched(channel, _identifier(words[2], base), dlc, length, data, base, remote, sent)


def _xl(words: list[str]) -> Event | None:
    """channel, direction, format, duration, bits, identifier, perhaps a name, DLC, length, bytes, CRC, flags

    Formats CBFF and CEFF are classical frames of an XL channel, base and extended; others are FD and XL.
    """
    if len(words) < 8 or not _CHANNEL.match(words[0]) or words[1].lower() not in _DIRECTIONS:
        return None
    if words[2].upper() not in ("CBFF", "CEFF"):
        return Omitted(FD if words[2].upper().startswith("F") else XL)
    at = _place(words, (6, 7), _XL_WORDS)
    if at is None:
        return Omitted(CUT)
    length, can_id = int(words[at + 1]), _identifier(words[5], 16)
    if can_id is not None and words[2].upper() == "CEFF":
        can_id |= EFF_FLAG
    rest = words[at + 2 + length :]
    remote = len(rest) > 1 and bool(_NUMBER[16].match(rest[1])) and bool(int(rest[1], 16) & _REMOTE)
    data = words[at + 2 : at + 2 + length]
    return _switched(
        int(words[0]) - 1, can_id, int(words[at], 16), length, data, 16, remote, words[1].lower() == "tx"
    )


def _switched(
    channel: int,
    can_id: int | None,
    dlc: int,
    length: int,
    words: list[str],
    base: int,
    remote: bool,
    sent: bool,
) -> Frame | Omitted:
    """A classical frame among those of a newer kind."""
    if can_id is None:
        return Omitted(UNNAMED)
    if remote:
        return Frame(channel, can_id | RTR_FLAG, min(dlc, WIDTH), sent=sent)
    data = _payload(words, min(length, WIDTH), base)
    return Omitted(CUT) if data is None else Frame(channel, can_id, len(data), data, sent)
