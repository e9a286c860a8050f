"""The scripts that run inside the kernel: its init, and the command with its folder and environment."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

from gnss_hil.tools.processes.vcan.machine import SYSTEM_PATH, module_folder

INTERFACES = ("vcan0", "vcan1")

_MODULES = (
    "net/can/can",
    "net/can/can-raw",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
    "net/can/can-gw",
)

_BUFFER_BYTES = 16 << 20

_INIT = """\
#!/bin/sh
PATH={path}:/usr/bin:/bin; export PATH
# The console keeps the kernel's messages; the command's output goes to the host's stdout and stderr.
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mkdir -p /dev/shm /dev/pts
mount -t tmpfs tmpfs /dev/shm
mount -t devpts devpts /dev/pts
mount -t tmpfs tmpfs /run
exec >{folder}/boot 2>&1
{modules}
{interfaces}
ip link set lo up
# vcan loses what a receiver has no room for; the usual buffer holds 278 frames.
echo {buffer} >/proc/sys/net/core/rmem_default
echo {buffer} >/proc/sys/net/core/rmem_max
{run}
stty -F /dev/tty0 sane  # returns once all output has left
stty -F /dev/tty1 sane
sync
echo o >/proc/sysrq-trigger
sleep 10
"""

_ON_TERMINAL = """\
stty -F /dev/tty0 sane
stty -F /dev/tty1 sane
setsid -c -w {folder}/command </dev/tty0 >/dev/tty0 2>/dev/tty1
echo $? >{folder}/status"""
"""The host's terminal is raw meanwhile: the guest echoes, ends lines and turns ^C into a signal."""

_IN_PIPES = """\
stty -F /dev/tty0 -opost -echo
stty -F /dev/tty1 -opost -echo
mkfifo /run/stdout /run/stderr
cat </run/stdout >/dev/tty0 & stdout=$!
cat </run/stderr >/dev/tty1 & stderr=$!
{folder}/command </dev/null >/run/stdout 2>/run/stderr
echo $? >{folder}/status
for left in /proc/[0-9]*; do  # whatever it left running would hold the pipes open
  case ${{left#/proc/}} in 1|$stdout|$stderr) ;; *) kill -9 ${{left#/proc/}} 2>/dev/null ;; esac
done
wait"""
"""The command sees pipes, not terminals: no colours, no rewritten lines."""

_COMMAND = """\
#!/bin/sh
{environment}
# A file renamed in the guest has its new name on the host at once and its bytes seconds later, or never if
# the kernel is killed: bytecode would be found truncated.
export PYTHONDONTWRITEBYTECODE=1
cd {directory} || exit 126
exec {command}
"""


def write(folder: Path, command: Sequence[str], environment: Mapping[str, str], terminal: bool) -> None:
    """The guest's init script and the command's."""
    modules = module_folder()
    init = _INIT.format(
        folder=folder,
        path=SYSTEM_PATH,
        buffer=_BUFFER_BYTES,
        run=(_ON_TERMINAL if terminal else _IN_PIPES).format(folder=folder),
        modules="\n".join(f"insmod {modules / name}.ko" for name in _MODULES),
        interfaces="\n".join(f"ip link add {i} type vcan; ip link set {i} mtu 72 up" for i in INTERFACES),
    )
    exports = [f"export {k}={shlex.quote(v)}" for k, v in environment.items() if k.isidentifier()]
    run = _COMMAND.format(
        environment="\n".join(exports), directory=shlex.quote(os.getcwd()), command=shlex.join(command)
    )
    for name, text in (("init", init), ("command", run)):
        (folder / name).write_text(text, "utf-8", "surrogateescape")
        (folder / name).chmod(0o700)
