"""States of which each follows from the one before, asked for in stretches of epochs.

A stretch that continues the last one costs its own steps alone; one further back is begun again from the
start. So a state is a function of its epoch, whatever was asked before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

State = TypeVar("State")


class Recursion(Generic[State]):
    """step  the state of an epoch from that of the one before, None before the first, and its number."""

    def __init__(self, step: Callable[[State | None, int], State]):
        self._step = step
        self._state: State | None = None
        self._next = 0

    def over(self, first: int, count: int) -> list[State]:
        """States of epochs first, first + 1, and so on."""
        if first < self._next:
            self._state, self._next = None, 0
        states = []
        for epoch in range(self._next, first + count):
            self._state = self._step(self._state, epoch)
            if epoch >= first:
                states.append(self._state)
        self._next = first + count
        return states
