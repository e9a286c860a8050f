"""Whom an identifier, a node number or a name may belong to, and that none belongs to two."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.layout import Kind

BENCH_FIRST, BENCH_LAST = 0x7D0, 0x7DE
"""Bench frames steer lockstep; they are not navigation, not in load figures, not recorded, not faulted."""

UDS_FIRST, UDS_LAST = 0x7DF, 0x7EF
"""Diagnostics of road vehicles (UDS, OBD) use these on every bus: ISO 15765-4, 11-bit identifiers."""


def check(kinds: Iterable[Kind], beside: Mapping[str, int]) -> None:
    """ValueError with one line if two kinds have a name or an identifier in common, or two nodes a number; if
    a kind has a sender or a receiver that is no node, or an identifier that there is not, that diagnostics
    use or that is kept for the bench.

    beside  number of each node beside the receivers
    It is asked of the most receivers: fewer have some of the same identifiers.
    """
    numbers: dict[int, str] = {r: f"RX{r}" for r in range(1, MAX_RECEIVERS + 1)}
    names: dict[str, Kind] = {}
    taken: dict[int, Kind] = {}
    for name, number in beside.items():
        if numbers.setdefault(number, name) != name:
            raise ValueError(f"nodes {numbers[number]} and {name} both have number {number}")
    for kind in kinds:
        if (other := names.setdefault(kind.name, kind)) is not kind:
            raise ValueError(f"kinds at 0x{other.base:03X} and 0x{kind.base:03X} both have name {kind.name}")
        sender = {"RX"} if kind.per == "receiver" else {"NODE"} if kind.per == "node" else set()
        for ends, node in ((sender, kind.sender), *(({"RX"}, node) for node in kind.receivers)):
            if node not in beside and node not in ends:
                raise ValueError(f"kind {kind.name}: there is no node {node}")
        for can_id in _identifiers(kind, numbers):
            if (other := taken.setdefault(can_id, kind)) is not kind:
                raise ValueError(f"kinds {other.name} and {kind.name} both have identifier 0x{can_id:03X}")
            if why := _barred(kind, can_id):
                raise ValueError(f"kind {kind.name}: identifier 0x{can_id:03X} {why}")


def _barred(kind: Kind, can_id: int) -> str:
    """Why a kind may not have an identifier, for people; "" if it may."""
    bench = kind.name.startswith("BENCH_")
    return next(
        (
            why
            for barred, why in (
                (not 0 < can_id < 1 << 11, "is none of 11 bits"),
                (UDS_FIRST <= can_id <= UDS_LAST, "is one of UDS"),
                (BENCH_FIRST <= can_id <= BENCH_LAST and not bench, "is kept for the bench"),
            )
            if barred
        ),
        "",
    )


def _identifiers(kind: Kind, numbers: Iterable[int]) -> Iterable[int]:
    """Identifiers of a kind with the most receivers and nodes of these numbers."""
    if kind.per == "receiver":
        return [kind.base + kind.stride * r for r in range(MAX_RECEIVERS)]
    return [kind.base + number - 1 for number in numbers] if kind.per == "node" else (kind.base,)
