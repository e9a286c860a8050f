"""The identifiers of the bus as a map: 0x000 to 0x7FF in rows of 64, the highest priority on top."""

from __future__ import annotations

from collections.abc import Iterator

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.messages import messages as contract_messages
from gnss_hil.tools.icd.contract import GROUPS, Contract, group_of
from gnss_hil.tools.report.markup import Markup, svg, tag

_ROWS, _COLUMNS = 32, 64
_CELL, _ROW = 10, 15
_LEFT, _TOP = 62, 30
_WIDTH = _LEFT + _COLUMNS * _CELL + 120


def _place(can_id: int) -> tuple[float, float]:
    return _LEFT + can_id % _COLUMNS * _CELL, _TOP + can_id // _COLUMNS * _ROW


def _cell(can_id: int, class_: str, says: str, **more) -> Markup:
    x, y = _place(can_id)
    return tag.g(
        tag.title(says), tag.rect(class_=class_, x=x + 1, y=y + 2, width=_CELL - 2, height=_ROW - 4, **more)
    )


def _axes() -> Iterator[Markup]:
    for row in range(_ROWS):
        y = _TOP + row * _ROW
        yield tag.rect(class_="free", x=_LEFT, y=y + 1, width=_COLUMNS * _CELL, height=_ROW - 2)
        yield tag.text(f"0x{row * _COLUMNS:03X}", x=_LEFT - 8, y=y + 11, class_="side")
    for column in range(0, _COLUMNS, 16):
        yield tag.text(f"+0x{column:02X}", x=_LEFT + column * _CELL, y=_TOP - 6, class_="mark")


def _used(contract: Contract) -> Iterator[Markup]:
    present = {m.frame_id for m in contract.messages}
    for m in contract.messages:
        says = f"0x{m.frame_id:03X} {m.name}"
        cell = _cell(m.frame_id, f"g{group_of(m.frame_id).tone}", says, data_id=m.frame_id)
        yield tag.a(cell, href=f"#{m.name}")
    for m in contract_messages(MAX_RECEIVERS):
        if m.can_id not in present:
            yield _cell(m.can_id, "kept", f"0x{m.can_id:03X} kept for {m.name}")


def _names() -> Iterator[Markup]:
    """Group names at the right of their first row; those of one row below each other."""
    lowest = 0.0
    for group in GROUPS:
        lowest = max(lowest + 14, _place(group.first)[1] + 11)
        x = _LEFT + _COLUMNS * _CELL + 10
        yield tag.rect(class_=f"g{group.tone}", x=x, y=lowest - 9, width=10, height=10)
        yield tag.text(group.name, x=x + 15, y=lowest, class_="mark")


def draw(contract: Contract) -> Markup:
    """Every identifier in use bears `data-id` and leads to its message."""
    return svg(
        _WIDTH, _TOP + _ROWS * _ROW + 8, _axes(), _used(contract), _names(),
        title="Map of the identifiers", class_="idmap",
    )  # fmt: skip
