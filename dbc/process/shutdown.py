"""A polite end: the first SIGINT or SIGTERM is noticed between epochs, the second one kills."""

from __future__ import annotations

import signal

INTERRUPTED = 130

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stop:
    """Within the context: `stop()` is True once a signal came."""

    def __init__(self):
        self._came = False

    def __enter__(self) -> Stop:
        self._before = {number: signal.signal(number, self._note) for number in _SIGNALS}
        return self

    def __exit__(self, *_) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def __call__(self) -> bool:
        return self._came

    def _note(self, number, frame) -> None:
        self._came = True
        signal.signal(number, signal.SIG_DFL)
