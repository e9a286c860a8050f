"""Virtual CAN on the machine's own kernel: what it needs, and what it says without."""

from __future__ import annotations

import subprocess
import sys

from gnss_hil.tools.processes.vcan import interfaces
from gnss_hil.tools.processes.vcan.machine import MISSING

PLAIN_USER = """
import os, sys
from gnss_hil.tools.processes.vcan import interfaces
if os.getuid() == 0:
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
sys.exit(interfaces.up(sys.argv[1:]))
"""


def test_up_says_that_it_needs_root():
    command = [sys.executable, "-c", PLAIN_USER]
    done = subprocess.run([*command, "nosuchcan0"], capture_output=True, text=True)
    assert done.returncode == MISSING
    assert done.stderr == (
        "gnss-hil vcan up: nosuchcan0: needs root (sudo gnss-hil vcan up nosuchcan0); without it: "
        "gnss-hil vcan shell -- COMMAND\n"
    )


def test_an_interface_that_is_up_needs_nobody(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(interfaces, "_INTERFACES", tmp_path)
    monkeypatch.setattr(interfaces, "_may_change_interfaces", lambda: False)
    (tmp_path / "vcan0").mkdir()
    (tmp_path / "vcan0" / "flags").write_text("0xc0\n")
    assert interfaces.up() == MISSING
    (tmp_path / "vcan0" / "flags").write_text("0xc1\n")
    assert interfaces.up() == 0
    assert capsys.readouterr().out == "vcan0 is up\n"
