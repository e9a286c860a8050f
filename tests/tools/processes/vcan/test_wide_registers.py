"""A user-mode Linux boots on processors with AMX too; that it does is judged in tests/system."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from gnss_hil.tools.processes.vcan import machine, shell, wide_registers
from tests.support.outside import c_tools

pytestmark = pytest.mark.verifies(
    "tools/processes/vcan/wide_registers.py",
    what="Wide registers of processors with AMX",
    by="flags as Linux has them; a debugger that gives a part of the registers, as user-mode Linux does",
    status="validated",
)

DEBUGGER = """
#define _GNU_SOURCE
#include <stdio.h>
#include <sys/ptrace.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>
#include <signal.h>
int main(void) {
    static char first[832], again[832];
    struct iovec part = {first, sizeof first}, check = {again, sizeof again};
    int child = fork(), status;
    if (!child) { ptrace(PTRACE_TRACEME, 0, 0, 0); raise(SIGSTOP); _exit(7); }
    waitpid(child, &status, 0);
    if (ptrace(PTRACE_GETREGSET, child, (void *)0x202, &part)) return 1;
    first[160] ^= 0x5A;  /* xmm0 */
    first[512] |= 2;     /* which is in use */
    if (ptrace(PTRACE_SETREGSET, child, (void *)0x202, &part)) return 2;
    if (ptrace(PTRACE_GETREGSET, child, (void *)0x202, &check)) return 3;
    if (first[160] != again[160]) return 4;
    ptrace(PTRACE_CONT, child, 0, 0);
    waitpid(child, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 7 ? 0 : 5;
}
"""


@pytest.mark.parametrize(
    ("flags", "wide"), [("fpu sse avx512f amx_tile amx_int8", True), ("fpu sse avx2", False)]
)
def test_processors_say_what_they_have(tmp_path, flags, wide):
    (tmp_path / "cpuinfo").write_text(
        f"processor\t: 0\nmodel name\t: amx_tile\nflags\t\t: {flags}\nbugs\t\t:\n"
    )
    assert wide_registers.are_there(tmp_path / "cpuinfo") is wide
    assert not wide_registers.are_there(tmp_path / "none")


def test_a_part_of_the_registers_is_enough(tmp_path, monkeypatch):
    """More than 832 bytes of extended registers has every processor with AVX-512, which the host takes back
    whole only; with the library a debugger may give what it knows of."""
    c_tools("cc")
    monkeypatch.setattr(wide_registers, "are_there", lambda: True)
    environment = os.environ | wide_registers.preloaded(tmp_path)
    (tmp_path / "debugger.c").write_text(DEBUGGER)
    subprocess.run(["cc", "-o", str(tmp_path / "debugger"), str(tmp_path / "debugger.c")], check=True)
    assert subprocess.run([str(tmp_path / "debugger")], env=environment, check=False).returncode == 0


def test_without_a_compiler_the_packages_are_named(monkeypatch):
    monkeypatch.setattr(wide_registers, "are_there", lambda: True)
    monkeypatch.setattr(wide_registers, "compiler", lambda: None)
    monkeypatch.setattr(machine, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(machine, "module_folder", lambda: Path("/"))
    assert machine.lacking() == wide_registers.LACKING


def test_a_compiler_without_headers_is_told_the_same_way(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(wide_registers, "are_there", lambda: True)
    monkeypatch.setattr(wide_registers, "compiler", lambda: "/bin/false")
    monkeypatch.setattr(machine, "lacking", lambda memory_bytes: "")
    assert shell.shell(["true"]) == machine.MISSING
    assert capsys.readouterr().err == f"gnss-hil vcan shell: {wide_registers.LACKING}\n"
