"""Virtual CAN: on a kernel that has it, or inside a Linux kernel that runs as an ordinary program.

`shell` boots Debian's user-mode Linux on the host's own files, with vcan0 and vcan1 up, and runs a command
there. It needs neither root nor kernel modules of the host. The kernel ends with the command, at a signal,
and with the process that started it, however that went.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import termios
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from gnss_hil.tools.processes import vcan_guard, wide_registers

INTERFACES = ("vcan0", "vcan1")
MISSING, TIMED_OUT = 3, 124

MODULES = (
    "net/can/can",
    "net/can/can-raw",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
    "net/can/can-gw",
)
_MODULE_ROOT = Path("/usr/lib/uml/modules")
_SYSTEM_PATH = "/usr/local/sbin:/usr/sbin:/sbin"
_PACKAGES = {
    "linux.uml": "user-mode-linux",
    "insmod": "kmod",
    "ip": "iproute2",
    "setsid": "util-linux",
    "stty": "coreutils",
}
"""Programs that the guest needs, and the Debian packages they come in."""

_BUFFER_BYTES = 16 << 20

MEMORY_BYTES = 2 << 30
"""Of the kernel; pages come into being as they are touched."""

_TEMPORARY = ("TMPDIR", "TMP", "TEMP")
"""Variables by which the kernel chooses where its memory lies."""

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


def up(argv: Sequence[str] = ()) -> int:
    """Creates vcan interfaces on this kernel (vcan0 if none is named); the exit status."""
    for interface in argv or INTERFACES[:1]:
        fault = _raise_interface(interface) if not _is_up(interface) else ""
        if fault:
            print(f"gnss-hil vcan up: {interface}: {fault}", file=sys.stderr)
            return MISSING
        print(f"{interface} is up")
    return 0


_CAP_NET_ADMIN = 12
"""capabilities(7): without it a process changes no interface."""


def _may_change_interfaces() -> bool:
    lines = Path("/proc/self/status").read_text().splitlines()
    return bool(next(int(x.split()[1], 16) for x in lines if x.startswith("CapEff:")) >> _CAP_NET_ADMIN & 1)


def _is_up(interface: str) -> bool:
    """Whether there is such an interface, and it is up (IFF_UP)."""
    try:
        return bool(int((_INTERFACES / interface / "flags").read_text(), 16) & 1)
    except OSError:
        return False


_INTERFACES = Path("/sys/class/net")


def _raise_interface(interface: str) -> str:
    """'' or why it cannot be."""
    if not _may_change_interfaces():
        return f"needs root (sudo gnss-hil vcan up {interface}); without it: gnss-hil vcan shell -- COMMAND"
    if _run("ip", "link", "show", interface):
        _run("modprobe", "vcan")  # built into some kernels: only the next line tells
        fault = _run("ip", "link", "add", interface, "type", "vcan")
        if fault:
            return f"this kernel gives no virtual CAN ({fault}); try `gnss-hil vcan shell -- COMMAND`"
    return _run("ip", "link", "set", interface, "up")


def _run(*command: str) -> str:
    """'' if the command succeeded, else the first line of its complaint."""
    program = _which(command[0])
    if program is None:
        return f"{command[0]}: not installed"
    done = subprocess.run([program, *command[1:]], capture_output=True, text=True)
    if done.returncode == 0:
        return ""
    return (done.stderr.strip() or f"{command[0]} ended with status {done.returncode}").splitlines()[0]


class _Ended(BaseException):
    """A signal that asks this process to end."""


class _Signals:
    """Signals that ask this process to end: noted when they come, and raised while the kernel is waited for.

    So none can come between a kernel and its end. What is ignored when it begins (nohup) stays so.
    """

    def __init__(self):
        self._came, self._waiting = 0, False

    def __enter__(self) -> _Signals:
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
            raise _Ended(self._came)

    @contextmanager
    def raised(self):
        """Within the context the first signal raises `_Ended`, also one that came before."""
        self._waiting = True
        try:
            if self._came:
                raise _Ended(self._came)
            yield
        finally:
            self._waiting = False


def shell(command: Sequence[str], timeout_s: float | None = None, memory_bytes: int = MEMORY_BYTES) -> int:
    """Runs a command in a user-mode Linux with vcan0 and vcan1; its exit status.

    Working folder, environment and the host's files are the command's. Its stdin is the terminal if there
    is one, else empty. 3: the kernel is missing or did not boot; 124: `timeout_s` passed; 128 + N: signal N
    asked it to end.
    """
    fault = _lacking(memory_bytes)
    if fault:
        print(f"gnss-hil vcan shell: {fault}", file=sys.stderr)
        return MISSING
    with _Signals() as signals, tempfile.TemporaryDirectory(prefix="gnss-hil-vcan-") as name:
        folder = Path(name)
        terminal = sys.stdin is not None and sys.stdin.isatty()
        _write(folder, command, os.environ, terminal)
        try:
            preloaded = wide_registers.preloaded(folder)
            with _kept_terminal(terminal):
                kernel = _Kernel(folder, terminal, memory_bytes, preloaded)
                kernel.run(timeout_s, signals)
        except _Ended as signalled:
            return 128 + signalled.args[0]
        except subprocess.CalledProcessError:
            print(f"gnss-hil vcan shell: {wide_registers.LACKING}", file=sys.stderr)
            return MISSING
        except subprocess.TimeoutExpired:
            print(f"gnss-hil vcan shell: stopped after {timeout_s:g} s", file=sys.stderr)
            return TIMED_OUT
        return _status(folder)


def _lacking(memory_bytes: int = MEMORY_BYTES) -> str:
    """'' or what user-mode Linux needs and this machine has not."""
    missing = sorted({package for name, package in _PACKAGES.items() if _which(name) is None})
    if missing:
        return f"needs the Debian packages {' '.join(missing)} (apt install {' '.join(missing)})"
    if not _modules().is_dir():
        return f"no modules for this user-mode-linux in {_MODULE_ROOT} (reinstall the package)"
    if wide_registers.are_there() and wide_registers.compiler() is None:
        return wide_registers.LACKING
    rooms = _rooms()
    if not rooms:
        return f"needs a writable folder that is not mounted noexec, for memory: {_MEMORY[0]} or TMPDIR"
    if memory_folder(memory_bytes) is None:
        name, room = max(rooms.items(), key=lambda item: item[1])
        return (
            f"needs {memory_bytes >> 20}M of room for memory; the most there is: {room >> 20}M, in {name} "
            "(--mem SIZE, or TMPDIR)"
        )
    return ""


_MEMORY = ("/dev/shm", "/tmp", "/var/tmp")
"""Where the kernel's memory may lie, best first: on a tmpfs it costs no disk."""


def memory_folder(memory_bytes: int) -> str | None:
    """The first folder with room for the kernel's memory: a full disk kills it in the middle of its work."""
    return next((name for name, room in _rooms().items() if room >= memory_bytes), None)


def _rooms() -> dict[str, int]:
    """Folders for the kernel's memory, which it maps as a program (in containers /dev/shm may be noexec),
    best first, and the bytes that are free there."""
    places = dict.fromkeys((_MEMORY[0], tempfile.gettempdir(), *_MEMORY[1:]))
    return {name: room for name in places if (room := _room(name)) is not None}


def _room(name: str) -> int | None:
    try:
        status = os.statvfs(name)
        if status.f_flag & os.ST_NOEXEC or not os.access(name, os.W_OK | os.X_OK):
            return None
    except OSError:
        return None
    return status.f_bavail * status.f_frsize


def _which(program: str) -> str | None:
    return shutil.which(program, path=f"{os.environ.get('PATH', os.defpath)}:{_SYSTEM_PATH}")


def _modules() -> Path:
    done = subprocess.run([_which("linux.uml") or "linux.uml", "--version"], capture_output=True, text=True)
    return _MODULE_ROOT / done.stdout.strip() / "kernel"


def _write(folder: Path, command: Sequence[str], environment: Mapping[str, str], terminal: bool) -> None:
    """The guest's init script and the command's."""
    modules = _modules()
    init = _INIT.format(
        folder=folder,
        path=_SYSTEM_PATH,
        buffer=_BUFFER_BYTES,
        run=(_ON_TERMINAL if terminal else _IN_PIPES).format(folder=folder),
        modules="\n".join(f"insmod {modules / name}.ko" for name in MODULES),
        interfaces="\n".join(f"ip link add {i} type vcan; ip link set {i} mtu 72 up" for i in INTERFACES),
    )
    exports = [f"export {k}={shlex.quote(v)}" for k, v in environment.items() if k.isidentifier()]
    run = _COMMAND.format(
        environment="\n".join(exports), directory=shlex.quote(os.getcwd()), command=shlex.join(command)
    )
    for name, text in (("init", init), ("command", run)):
        (folder / name).write_text(text, "utf-8", "surrogateescape")
        (folder / name).chmod(0o700)


@dataclass(frozen=True, slots=True)
class _Kernel:
    """A kernel to be run: the folder of its scripts, whether it has the terminal, its memory, and what its
    environment needs besides."""

    folder: Path
    terminal: bool
    memory_bytes: int
    environment: Mapping[str, str]

    def run(self, timeout_s: float | None, signals: _Signals) -> None:
        """To its end, or to a signal's or the time's; a guard ends it if we cannot."""
        with _guard(self.folder) as tell:
            kernel = self._start()
            try:
                tell(kernel.pid)
                _keep_on_one_processor(kernel.pid)
                with signals.raised():
                    kernel.wait(timeout_s)
            finally:
                if kernel.poll() is None:
                    os.killpg(kernel.pid, signal.SIGKILL)  # its guest processes are processes of ours, too
                    kernel.wait()

    def _start(self) -> subprocess.Popen:
        return subprocess.Popen(
            [
                _which("linux.uml") or "linux.uml", f"mem={self.memory_bytes >> 20}M",
                "rootfstype=hostfs", "rootflags=/", "rw", f"init={self.folder}/init",
                "con=null", f"con0={'fd:0' if self.terminal else 'null'},fd:1", "con1=null,fd:2",
                "console=tty9", "quiet", f"uml_dir={self.folder}/",
            ],
            stdin=None if self.terminal else subprocess.DEVNULL,
            process_group=0,
            preexec_fn=_take_terminal if self.terminal else None,
            env={key: value for key, value in os.environ.items() if key not in _TEMPORARY}
            | {"TMPDIR": memory_folder(self.memory_bytes) or _MEMORY[0]}
            | dict(self.environment),
        )  # fmt: skip


def _keep_on_one_processor(process: int) -> None:
    """Kernel and guest processes take turns by ptrace; across two that costs up to five times more."""
    allowed = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(process, {allowed[process % len(allowed)]})


@contextmanager
def _guard(folder: Path) -> Iterator[Callable[[int], None]]:
    """A process that ends the kernel and removes its folder should this one be killed; takes what to end."""
    guard = subprocess.Popen(
        [sys.executable, "-I", "-S", vcan_guard.__file__, str(folder)],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, process_group=0,
    )  # fmt: skip
    assert guard.stdin
    with guard.stdin as pipe:

        def tell(group: int) -> None:
            with suppress(BrokenPipeError):  # one that was killed guards nothing
                os.write(pipe.fileno(), str(group).encode())

        try:
            yield tell
        finally:
            guard.kill()
            guard.wait()


def _take_terminal() -> None:
    """Makes this process's group the terminal's foreground, before it is a kernel: that must neither be
    stopped for touching the terminal nor be reached by the signal that ends such a stop."""
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # else taking it from the background would stop it
    os.tcsetpgrp(sys.stdin.fileno(), os.getpgrp())
    signal.signal(signal.SIGTTOU, signal.SIG_DFL)


@contextmanager
def _kept_terminal(terminal: bool):
    """The kernel takes the terminal and makes it raw; afterwards it is ours and as before."""
    if not terminal:
        yield
        return
    before = termios.tcgetattr(sys.stdin)
    try:
        yield
    finally:
        handler = signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # else taking it back would stop us
        os.tcsetpgrp(sys.stdin.fileno(), os.getpgrp())
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        signal.signal(signal.SIGTTOU, handler)


def _status(folder: Path) -> int:
    with suppress(OSError, ValueError):
        return int((folder / "status").read_text())
    boot = folder / "boot"
    lines = boot.read_text(errors="replace").strip().splitlines() if boot.exists() else []
    print(f"gnss-hil vcan shell: the kernel did not boot{': ' + lines[-1] if lines else ''}", file=sys.stderr)
    return MISSING
