"""What can go wrong for people: one clear line each and an exit status."""

from __future__ import annotations

PROGRAM = "gnss-hil"


class Mistake(Exception):
    """Bad usage, scenario or input. The text is one line a fault: what, what was found, what is allowed."""

    status = 2


class Missing(Mistake):
    """The environment lacks something: no such bus, no such program."""

    status = 3


class Failed(Mistake):
    """The run went wrong after it had started."""

    status = 1
