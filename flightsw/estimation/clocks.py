"""Clocks as unknowns: one for each clock domain, and the time offset of each system from the reference.

A clock and an offset can be told apart only where systems are tracked together. Domains and systems that are
linked by measurements form a component; in one that lacks the reference system the clocks contain the time
offset of its first system (of the table's lowest number), and that offset is no unknown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.systems import offset_items, reference

REFERENCE = reference().value
OFFSET_ITEM: tuple[int, ...] = tuple(offset_items().tolist())
"""By system: its item of NAV_CLOCK; -1 for the reference."""


def is_offset(item: int) -> bool:
    """Whether an item of NAV_CLOCK is a system's time offset; else it is a clock domain."""
    return item in OFFSET_ITEM


def base_system(systems: Iterable[int]) -> int:
    """The system whose time the clocks are by where these (at least one) are tracked together."""
    return min(systems, key=_by_rank)


def _by_rank(system: int) -> tuple[bool, int]:
    return system != REFERENCE, system


def estimable_offsets(tracked: Iterable[tuple[int, int]]) -> list[int]:
    """Systems whose time offsets these pairs (clock domain, system) tell apart from the clocks."""
    linked: list[tuple[set[int], set[int]]] = []
    for domain, system in tracked:
        domains, systems = {domain}, {system}
        apart = []
        for other in linked:
            if domain in other[0] or system in other[1]:
                domains |= other[0]
                systems |= other[1]
            else:
                apart.append(other)
        linked = [*apart, (domains, systems)]
    return sorted(s for _, systems in linked for s in systems - {base_system(systems)})


def clock_columns(domain: I64, system: I64) -> tuple[tuple[int, ...], F64]:
    """Items (c,) and design columns (n, c) of the clocks and offsets that these measurements can tell apart.

    domain, system   (n,) clock domain and satellite system of each
    """
    return _clock_columns(domain.tobytes(), system.tobytes())


@lru_cache(maxsize=64)
def _clock_columns(domains_tracked: bytes, systems_tracked: bytes) -> tuple[tuple[int, ...], F64]:
    """Most epochs measure the same satellites on the same channels as the one before."""
    domain, system = np.frombuffer(domains_tracked, np.int64), np.frombuffer(systems_tracked, np.int64)
    domains, offsets, items = _unknowns(frozenset(zip(domain.tolist(), system.tolist(), strict=True)))
    columns = np.concatenate((domain[:, None] == domains, system[:, None] == offsets), axis=1).astype(float)
    columns.setflags(write=False)
    return items, columns


@lru_cache(maxsize=256)
def _unknowns(tracked: frozenset[tuple[int, int]]) -> tuple[I64, I64, tuple[int, ...]]:
    """Domains, systems with an offset of their own, and the items of both."""
    domains, offsets = sorted({d for d, _ in tracked}), estimable_offsets(tracked)
    items = (*domains, *(OFFSET_ITEM[s] for s in offsets))
    return np.array(domains, np.int64), np.array(offsets, np.int64), items


@dataclass(frozen=True, slots=True)
class ReceiverClocks:
    """Of one receiver's own solution: items with their values (biases, or drifts), and the systems used."""

    items: tuple[int, ...]
    values: F64
    systems: frozenset[int]


def mean_clocks(receivers: Sequence[ReceiverClocks]) -> tuple[tuple[int, ...], F64]:
    """Items (c,) and their means (c,), of biases or of drifts.

    A domain's clock is the mean over its receivers with the first base system among them: the reference, else
    the clock contains an offset, as the contract has it. An offset is the mean over the receivers by the
    reference that estimate it; of receivers by another system, in a domain where one is by the reference, it
    is what their clocks are later, and theirs are counted from there.
    """
    by_domain: dict[int, dict[int, list[float]]] = {}
    for r in receivers:
        by_base = by_domain.setdefault(r.items[0], {})
        by_base.setdefault(base_system(r.systems), []).append(float(r.values[0]))
    clocks = {d: float(np.mean(by_base[base_system(by_base)])) for d, by_base in sorted(by_domain.items())}
    offsets: dict[int, list[float]] = {}
    for r in receivers:
        domain, base, (clock, *estimated) = r.items[0], base_system(r.systems), r.values.tolist()
        if REFERENCE not in by_domain[domain]:
            continue
        later = 0.0 if base == REFERENCE else clock - clocks[domain]
        if base != REFERENCE:
            offsets.setdefault(OFFSET_ITEM[base], []).append(later)
        for item, offset in zip(r.items[1:], estimated, strict=True):
            offsets.setdefault(item, []).append(later + offset)
    means = {item: float(np.mean(values)) for item, values in sorted(offsets.items())}
    return (*clocks, *means), np.array([*clocks.values(), *means.values()])
