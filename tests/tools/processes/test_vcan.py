"""What `vcan` asks of the machine, and where the kernel of `vcan shell` has its memory.

That it boots and ends is judged in tests/system.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.commands.vcan import memory
from gnss_hil.tools.processes import vcan

GIB = 1 << 30


@pytest.fixture
def mounted(monkeypatch):
    """Folders as they may be mounted: name -> flags and bytes free, None where there is no such folder."""
    found: dict[str, tuple[int, int] | None]
    found = dict.fromkeys(("/dev/shm", "/mine", "/tmp", "/var/tmp"), (0, 8 * GIB))

    def status(name):
        if found[name] is None:
            raise FileNotFoundError(name)
        flags, free = found[name]
        return SimpleNamespace(f_flag=flags, f_bavail=free >> 12, f_frsize=1 << 12)

    monkeypatch.setattr(vcan.os, "statvfs", status)
    monkeypatch.setattr(vcan.os, "access", lambda name, mode: True)
    monkeypatch.setattr(vcan.tempfile, "gettempdir", lambda: "/mine")
    return found


def test_memory_lies_where_programs_may(mounted):
    assert vcan.memory_folder(GIB) == "/dev/shm"
    for taken, found in (("/dev/shm", "/mine"), ("/mine", "/tmp"), ("/tmp", "/var/tmp"), ("/var/tmp", None)):
        mounted[taken] = (os.ST_NOEXEC, 8 * GIB) if taken != "/mine" else None
        assert vcan.memory_folder(GIB) == found


def test_memory_lies_where_there_is_room(mounted):
    mounted["/dev/shm"] = (0, 64 << 20)  # as Docker has it
    assert vcan.memory_folder(64 << 20) == "/dev/shm"
    assert vcan.memory_folder(2 * GIB) == "/mine"


@pytest.fixture
def equipped(monkeypatch):
    monkeypatch.setattr(vcan, "_which", lambda program: "/bin/true")
    monkeypatch.setattr(vcan, "_modules", lambda: vcan.Path("/"))


def test_without_such_a_folder_the_reason_is_told(mounted, equipped):
    assert not vcan._lacking()
    mounted.update(dict.fromkeys(mounted, (0, GIB)))
    mounted["/tmp"] = (0, 2 * GIB - 4096)
    assert vcan._lacking(GIB) == ""
    assert vcan._lacking().startswith(
        "needs 2048M of room for memory; the most there is: 2047M, in /tmp (--mem"
    )
    mounted.update(dict.fromkeys(mounted, (os.ST_NOEXEC, GIB)))
    assert "needs a writable folder that is not mounted noexec" in vcan._lacking()


def test_a_size_of_memory_is_read_strictly(capsys):
    assert (memory("128M"), memory("2G"), memory("64G")) == (128 << 20, 2 << 30, 64 << 30)
    for text in ("", "2", "2g", "2GB", "-2G", "1.5G", "127M", "65G", " 2G", "2G\n", "\u0662G"):
        assert main(["vcan", "shell", f"--mem={text}", "--", "true"]) == 2
        said = capsys.readouterr().err
        assert said.startswith("gnss-hil: --mem: ") and "from 128M to 64G" in said
        assert said.count("\n") <= 1 + text.count("\n")


def test_the_command_is_handed_on_as_it_is(monkeypatch):
    asked = []
    monkeypatch.setattr(vcan, "shell", lambda command, memory_bytes: asked.append((command, memory_bytes)))
    for before, size in ((["--"], 2 * GIB), ([], 2 * GIB), (["--mem", "512M", "--"], GIB // 2)):
        main(["vcan", "shell", *before, "candump", "-L", "--mem", "vcan0", "--debug"])
        assert asked.pop() == (["candump", "-L", "--mem", "vcan0", "--debug"], size)


PLAIN_USER = """
import os, sys
from gnss_hil.tools.processes import vcan
if os.getuid() == 0:
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
sys.exit(vcan.up(sys.argv[1:]))
"""


def test_up_says_that_it_needs_root():
    command = [sys.executable, "-c", PLAIN_USER]
    done = subprocess.run([*command, "nosuchcan0"], capture_output=True, text=True)
    assert done.returncode == vcan.MISSING
    assert done.stderr == (
        "gnss-hil vcan up: nosuchcan0: needs root (sudo gnss-hil vcan up nosuchcan0); without it: "
        "gnss-hil vcan shell -- COMMAND\n"
    )


def test_an_interface_that_is_up_needs_nobody(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(vcan, "_INTERFACES", tmp_path)
    monkeypatch.setattr(vcan, "_may_change_interfaces", lambda: False)
    (tmp_path / "vcan0").mkdir()
    (tmp_path / "vcan0" / "flags").write_text("0xc0\n")
    assert vcan.up() == vcan.MISSING
    (tmp_path / "vcan0" / "flags").write_text("0xc1\n")
    assert vcan.up() == 0
    assert capsys.readouterr().out == "vcan0 is up\n"


def test_a_signal_is_raised_once_and_only_where_it_is_waited_for():
    before = signal.getsignal(signal.SIGTERM)
    with vcan._Signals() as signals:
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(vcan._Ended) as ended, signals.raised():
            pytest.fail("the signal that came before is not raised")
        assert ended.value.args == (signal.SIGTERM,)
    with vcan._Signals() as signals:
        with pytest.raises(vcan._Ended) as ended, signals.raised():
            try:
                signal.raise_signal(signal.SIGHUP)
            finally:
                signal.raise_signal(signal.SIGTERM)  # while it cleans up
        assert ended.value.args == (signal.SIGHUP,)
    assert signal.getsignal(signal.SIGTERM) is before


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with vcan._Signals() as signals, signals.raised():
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)
