"""Where a process of the bench stands, for the one that started it."""

from __future__ import annotations

import json
import os
from typing import Any

STATUS_S = 0.2


class StatusLog:
    """JSON lines for the supervisor; "fd:N" or a file's path, None: nowhere."""

    def __init__(self, target: str | None):
        where = os.devnull if target is None else target
        self._stream = open(int(where[3:]) if where.startswith("fd:") else where, "w")  # noqa: SIM115
        self._next_s = 0.0

    def __enter__(self) -> StatusLog:
        return self

    def __exit__(self, *_) -> None:
        self._stream.close()

    def due(self, now_s: float) -> bool:
        """True at most five times a second."""
        if now_s < self._next_s:
            return False
        self._next_s = now_s + STATUS_S
        return True

    def tell(self, event: str, **values: Any) -> None:
        self._stream.write(json.dumps({"event": event, **values}) + "\n")
        self._stream.flush()
