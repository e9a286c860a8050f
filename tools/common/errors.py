"""What can go wrong for people: one clear line each and an exit status."""

from __future__ import annotations

import sys

PROGRAM = "gnss-hil"
INTERRUPTED = 130


class Mistake(Exception):
    """Bad usage, scenario or input. The text is one line a fault: what, what was found, what is allowed."""

    status = 2


class Missing(Mistake):
    """The environment lacks something: no such bus, no such program."""

    status = 3


class Failed(Mistake):
    """The run went wrong after it had started."""

    status = 1


def status_and_text(error: BaseException) -> tuple[int, str] | None:
    """Exit status and text of an error that people can understand; None if it is a fault of the program.

    The classes are looked up among loaded modules: what is not loaded cannot have been raised.
    """
    if isinstance(error, Mistake):
        return error.status, str(error)
    for module, name, status in (
        ("gnss_hil.emulator.config.scenario", "ScenarioError", 2),
        ("gnss_hil.dbc.common.vehicle", "VehicleError", 2),
        ("gnss_hil.dbc.bus.base", "LinkError", 3),
        ("gnss_hil.emulator.orbits.dynamics", "OrbitError", 2),
        ("gnss_hil.emulator.error_models.checked", "ModelError", 1),
        ("gnss_hil.tools.recording.formats.piece", "LogError", 2),
        ("gnss_hil.tools.results.truth", "TruthError", 2),
    ):
        if module in sys.modules and isinstance(error, getattr(sys.modules[module], name)):
            return status, str(error)
    if isinstance(error, OSError) and error.strerror:  # disk full, no permission
        return 1, f"{error.filename or 'standard output'}: {error.strerror}"  # files have names
    return None
