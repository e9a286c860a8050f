"""What a kernel of `vcan shell` asks of the machine, and where it has its memory."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from gnss_hil.tools.processes.vcan import machine

pytestmark = pytest.mark.verifies(
    "tools/processes/vcan/machine.py",
    what="What a kernel of a virtual CAN needs of the machine",
    by="rules of ours, on folders mounted in every way",
    status="modelled",
)

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

    monkeypatch.setattr(machine.os, "statvfs", status)
    monkeypatch.setattr(machine.os, "access", lambda name, mode: True)
    monkeypatch.setattr(machine.tempfile, "gettempdir", lambda: "/mine")
    return found


def test_memory_lies_where_programs_may(mounted):
    assert machine.memory_folder(GIB) == "/dev/shm"
    for taken, found in (("/dev/shm", "/mine"), ("/mine", "/tmp"), ("/tmp", "/var/tmp"), ("/var/tmp", None)):
        mounted[taken] = (os.ST_NOEXEC, 8 * GIB) if taken != "/mine" else None
        assert machine.memory_folder(GIB) == found


def test_memory_lies_where_there_is_room(mounted):
    mounted["/dev/shm"] = (0, 64 << 20)  # as Docker has it
    assert machine.memory_folder(64 << 20) == "/dev/shm"
    assert machine.memory_folder(2 * GIB) == "/mine"


@pytest.fixture
def equipped(monkeypatch):
    monkeypatch.setattr(machine, "which", lambda program: "/bin/true")
    monkeypatch.setattr(machine, "module_folder", lambda: Path("/"))


def test_without_such_a_folder_the_reason_is_told(mounted, equipped):
    assert not machine.lacking()
    mounted.update(dict.fromkeys(mounted, (0, GIB)))
    mounted["/tmp"] = (0, 2 * GIB - 4096)
    assert machine.lacking(GIB) == ""
    assert machine.lacking().startswith(
        "needs 2048M of room for memory; the most there is: 2047M, in /tmp (--mem"
    )
    mounted.update(dict.fromkeys(mounted, (os.ST_NOEXEC, GIB)))
    assert "needs a writable folder that is not mounted noexec" in machine.lacking()
