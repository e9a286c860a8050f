"""Where the kernel of `vcan shell` has its memory; that it boots is judged in tests/system."""

from __future__ import annotations

import os
from types import SimpleNamespace

import pytest

from gnss_hil.tools.processes import vcan


@pytest.fixture
def mounted(monkeypatch):
    """Folders as they may be mounted: name -> flags, None where there is no such folder."""
    flags: dict[str, int | None] = {"/dev/shm": 0, "/tmp": 0, "/var/tmp": 0, "/mine": 0}

    def status(name):
        if flags[name] is None:
            raise FileNotFoundError(name)
        return SimpleNamespace(f_flag=flags[name])

    monkeypatch.setattr(vcan.os, "statvfs", status)
    monkeypatch.setattr(vcan.os, "access", lambda name, mode: True)
    monkeypatch.setattr(vcan.tempfile, "gettempdir", lambda: "/mine")
    return flags


def test_memory_lies_where_programs_may(mounted):
    assert vcan.memory_folder() == "/dev/shm"
    for taken, found in (("/dev/shm", "/mine"), ("/mine", "/tmp"), ("/tmp", "/var/tmp"), ("/var/tmp", None)):
        mounted[taken] = os.ST_NOEXEC if taken != "/mine" else None
        assert vcan.memory_folder() == found


def test_without_such_a_folder_the_reason_is_told(mounted, monkeypatch):
    monkeypatch.setattr(vcan, "_which", lambda program: "/bin/true")
    monkeypatch.setattr(vcan, "_modules", lambda: vcan.Path("/"))
    assert not vcan._lacking()
    mounted.update(dict.fromkeys(mounted, os.ST_NOEXEC))
    assert "needs a writable folder that is not mounted noexec" in vcan._lacking()
