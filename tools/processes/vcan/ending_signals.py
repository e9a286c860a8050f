"""Signals that ask this process to end, while it has a kernel to end first."""

from __future__ import annotations

import signal
from contextlib import contextmanager


class Ended(BaseException):
    """A signal that asks this process to end."""


class EndingSignals:
    """Signals that ask this process to end: noted when they come, and raised while the kernel is waited for.

    So none can come between a kernel and its end. What is ignored when it begins (nohup) stays so.
    """

    def __init__(self):
        self._came, self._waiting = 0, False

    def __enter__(self) -> EndingSignals:
        asked = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        heard = (n for n in asked if signal.getsignal(n) is not signal.SIG_IGN)
        self._before = {number: signal.signal(number, self._note) for number in heard}
        return self

    def __exit__(self, *_) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number, frame) -> None:
        self._came = self._came or number
        if self._waiting:
            self._waiting = False
            raise Ended(self._came)

    @contextmanager
    def raised(self):
        """Within the context the first signal raises `Ended`, also one that came before."""
        self._waiting = True
        try:
            if self._came:
                raise Ended(self._came)
            yield
        finally:
            self._waiting = False
