"""The embedded bus of a bench that runs here, so that its path need not be typed."""

from __future__ import annotations

import os
from pathlib import Path

from gnss_hil.dbc.bus.runtime_dir import parent_folder
from gnss_hil.tools.common.errors import Missing, Mistake

_PATTERN = "gnss-hil-*/can*"
"""Sockets in the private folders of benches; `gnss_hil.dbc.bus.hub.RuntimeDir`,
`gnss_hil.tools.processes`."""

_KERNEL_LIST = Path("/proc/net/unix")


def sockets(parent: Path) -> list[Path]:
    """Sockets of benches below a temporary folder that have a listener; joins none of them.

    A bench that was killed leaves its socket behind; where the kernel lists its sockets, those are left out.
    """
    found = [path for path in sorted(parent.glob(_PATTERN)) if path.is_socket()]
    if not _KERNEL_LIST.exists():
        return found
    listed = {line.split(maxsplit=7)[-1] for line in _KERNEL_LIST.read_text(errors="replace").splitlines()}
    return [path for path in found if os.fspath(path) in listed]


def running_bus() -> str:
    """The one embedded bus of this user; Missing if there is none, Mistake if there are several."""
    there = sockets(parent_folder())
    found = [path for path in there if _is_ours(path)]
    if there and not found:
        raise Missing(
            f"--bus embedded: the bench that runs here is another user's ({there[0]}); start one of yours"
        )
    if not found:
        raise Missing("--bus embedded: no bench is running on a bus of its own; start one, or name the bus")
    if len(found) > 1:
        names = ", ".join(f"embedded:{path}" for path in found)
        raise Mistake(f"--bus embedded: several are running; name one: {names}")
    return f"embedded:{found[0]}"


def _is_ours(path: Path) -> bool:
    """Whether a socket is this user's; one that is gone by now is nobody's."""
    try:
        return path.stat().st_uid == os.getuid()
    except OSError:
        return False
