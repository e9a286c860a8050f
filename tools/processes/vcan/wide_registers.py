"""User-mode Linux on processors with AMX: Debian 12's has no room for their registers and does not boot.

Some lines of C between it and the host's ptrace(2) help; they are compiled where they are needed.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

SOURCE = Path(__file__).with_suffix(".c")
LACKING = "the kernel does not know this processor's AMX registers: needs gcc (apt install gcc libc6-dev)"

_PROCESSORS = Path("/proc/cpuinfo")
_WIDE = "amx_tile"


def are_there(processors: Path = _PROCESSORS) -> bool:
    """Whether the processor has them."""
    try:
        lines = processors.read_text(errors="replace").splitlines()
    except OSError:
        return False
    return any(_WIDE in line.split() for line in lines if line.startswith("flags"))


def compiler() -> str | None:
    return shutil.which("cc") or shutil.which("gcc")


def preloaded(folder: Path) -> dict[str, str]:
    """What a kernel's environment needs, compiled into a folder; nothing on other processors.

    CalledProcessError where the compiler fails
    """
    found = compiler()
    if not are_there() or found is None:
        return {}
    library = folder / "wide_registers.so"
    subprocess.run(
        [found, "-O2", "-shared", "-fPIC", "-o", str(library), str(SOURCE)],
        check=True,
        capture_output=True,
        text=True,
    )
    return {"LD_PRELOAD": str(library)}
