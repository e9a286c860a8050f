"""A polite end: the first SIGINT, SIGTERM or SIGHUP is noticed between epochs, the second one kills."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 128 + signal.SIGINT
"""Exit status of what Ctrl-C ended; of another signal 128 and its number, as shells have it."""

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def interruptible() -> Iterator[None]:
    """Within: a signal that nobody waits for (`Stop`) is a KeyboardInterrupt, whichever of the three it is;
    `status_of` has its exit status. What is ignored, or heard by another, stays so."""
    mine = threading.current_thread() is threading.main_thread()
    unheard = (signal.SIG_DFL, signal.default_int_handler)
    before = {n: signal.getsignal(n) for n in _SIGNALS if mine and signal.getsignal(n) in unheard}
    for number in before:
        signal.signal(number, _interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(number, frame) -> None:
    raise KeyboardInterrupt(number)


def status_of(interrupt: KeyboardInterrupt) -> int:
    """Exit status of what an interrupt ended."""
    return 128 + interrupt.args[0] if interrupt.args else INTERRUPTED


class Stop:
    """Within the context: `stop()` is True once a signal came, and `status` is the exit status then.

    What is ignored when it begins stays so: under nohup a hangup ends nothing. Signals belong to the main
    thread (Python, `signal`): in another nothing is heard, and whoever owns the process ends it as before.
    """

    def __init__(self):
        self._came = 0

    def __enter__(self) -> Stop:
        ours = _SIGNALS if threading.current_thread() is threading.main_thread() else ()
        heard = (n for n in ours if n is signal.SIGINT or signal.getsignal(n) is not signal.SIG_IGN)
        self._before = {number: signal.signal(number, self._note) for number in heard}
        return self

    def __exit__(self, *_) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def __call__(self) -> bool:
        return self._came != 0

    @property
    def status(self) -> int:
        return 128 + self._came if self._came else INTERRUPTED

    def _note(self, number, frame) -> None:
        if self._came:
            self._again(number)
        self._came = self._came or number

    def _again(self, number: int) -> None:
        """A second signal: whoever sent it does not want to wait."""
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)
