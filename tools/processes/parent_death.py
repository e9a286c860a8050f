"""`python -I -S parent_death.py PARENT COMMAND...`: becomes COMMAND, which ends when process PARENT dies.

A script, and one that imports next to nothing: it stands before every process of a run. The kernel sends
SIGTERM when the parent is gone, however it went; `prctl(2)`, PR_SET_PDEATHSIG outlives `execve`.
"""

import ctypes
import os
import sys

PR_SET_PDEATHSIG, SIGTERM = 1, 15


def main(parent: str, *command: str) -> None:
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, SIGTERM, 0, 0, 0)
    if os.getppid() != int(parent):  # it died before the kernel was asked
        sys.exit(1)
    try:
        os.execvp(command[0], command)
    except OSError as error:
        sys.exit(f"{command[0]}: {error.strerror}")


if __name__ == "__main__":
    main(*sys.argv[1:])
