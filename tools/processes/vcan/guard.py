"""`python -I -S guard.py FOLDER <PIPE`: ends a kernel whose starter died before it could.

A script, and one that imports next to nothing. It reads the kernel's process group from the pipe. When the
pipe ends, its starter is gone, however it went; the group is killed and the kernel's folder removed. A
starter that ends the kernel itself kills the guard first.
"""

import os
import shutil
import signal
import sys
from contextlib import suppress


def main(folder: str) -> None:
    # What is meant for its starter (Ctrl-C, a terminal that hangs up) must not end the guard before it.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    group = sys.stdin.read().strip()
    if group:
        with suppress(ProcessLookupError):
            os.killpg(int(group), signal.SIGKILL)
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
