"""Work done ahead by threads, its results in order: decompression leaves the interpreter free meanwhile."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
WORKERS = 2


def in_order(tasks: Iterable[Callable[[], T]]) -> Iterator[T]:
    """The results of tasks, one after the other; no more than WORKERS of them are begun or held ahead.

    What a task raises comes in its place.
    """
    with ThreadPoolExecutor(WORKERS) as pool:
        begun: deque = deque()
        try:
            for task in tasks:
                begun.append(pool.submit(task))
                if len(begun) > WORKERS:
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        finally:
            for future in begun:
                future.cancel()
