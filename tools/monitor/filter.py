"""Which frames a person wants to see: by message, kind, sender or identifier."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.near import nearest
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import EFF_MASK, ERR_FLAG, SFF_MASK
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.monitor.format import UNKNOWN, Formatter

_IDENTIFIER = re.compile(r"0[xX]([0-9a-fA-F]{1,8})(?:-0[xX]([0-9a-fA-F]{1,8}))?")

_EXAMPLES = "for example RX1_RANGE, RX1_*, RANGE, FLIGHT, 0x100 or 0x100-0x10F"


class FrameFilter:
    """Frames to be shown; without a pattern all of them, those of no contract too."""

    def __init__(self, codec: Codec, formatter: Formatter, patterns: Sequence[str]):
        self._all = not patterns
        self._base = np.full(IDENTIFIERS, self._all)
        self._ranges: list[tuple[int, int]] = []
        labels = _labels(codec, formatter)
        for pattern in (part for text in patterns for part in text.split(",")):
            if match := _IDENTIFIER.fullmatch(pattern):
                self._add_range(pattern, int(match[1], 16), int(match[2] or match[1], 16))
            else:
                self._add_names(pattern, labels)

    def _add_range(self, pattern: str, first: int, last: int) -> None:
        if not first <= last <= EFF_MASK:
            raise Mistake(f"--only {pattern}: identifiers go up, to 0x{EFF_MASK:X} at most")
        self._base[first : last + 1] = True
        self._ranges.append((first, last))

    def _add_names(self, pattern: str, labels: dict[str, list[int]]) -> None:
        ids = [i for label, found in labels.items() if fnmatchcase(label, pattern.upper()) for i in found]
        if not ids:
            near = nearest(pattern, labels)
            hint = f"did you mean '{near}'?" if near else _EXAMPLES
            raise Mistake(f"--only {pattern}: no message, kind or sender of that name; {hint}")
        self._base[ids] = True

    def of(self, can_id: NDArray[np.uint32]) -> NDArray[np.bool_]:
        """(n,) whether each frame is to be shown."""
        shown = self._base[can_id & SFF_MASK]
        beyond = can_id > SFF_MASK
        if beyond.any() and not self._all:
            number = can_id & EFF_MASK
            wanted = np.zeros(len(can_id), bool)
            for first, last in self._ranges:
                wanted |= (number >= first) & (number <= last) & (can_id & ERR_FLAG == 0)
            shown = np.where(beyond, wanted, shown)
        return shown


def _labels(codec: Codec, formatter: Formatter) -> dict[str, list[int]]:
    """What a pattern may name -> identifiers."""
    labels: dict[str, list[int]] = {}
    kinds = tuple(codec.kinds)
    for can_id, name in enumerate(formatter.name_of):
        if name != UNKNOWN:
            for label in {name, kinds[codec.kind_of[can_id]], codec.sender_of[can_id]}:
                labels.setdefault(label, []).append(can_id)
    return labels
