"""How `gnss-hil vcan` is written. That its kernel boots and ends is judged in tests/system."""

from __future__ import annotations

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.commands.vcan import memory
from gnss_hil.tools.processes.vcan import shell

GIB = 1 << 30


def test_a_size_of_memory_is_read_strictly(capsys):
    assert (memory("128M"), memory("2G"), memory("64G")) == (128 << 20, 2 << 30, 64 << 30)
    for text in ("", "2", "2g", "2GB", "-2G", "1.5G", "127M", "65G", " 2G", "2G\n", "\u0662G"):
        assert main(["vcan", "shell", f"--mem={text}", "--", "true"]) == 2
        said = capsys.readouterr().err
        assert said.startswith("gnss-hil: --mem: ") and "from 128M to 64G" in said
        assert said.count("\n") <= 1 + text.count("\n")


def test_the_command_is_handed_on_as_it_is(monkeypatch):
    asked = []
    monkeypatch.setattr(shell, "shell", lambda command, memory_bytes: asked.append((command, memory_bytes)))
    for before, size in ((["--"], 2 * GIB), ([], 2 * GIB), (["--mem", "512M", "--"], GIB // 2)):
        main(["vcan", "shell", *before, "candump", "-L", "--mem", "vcan0", "--debug"])
        assert asked.pop() == (["candump", "-L", "--mem", "vcan0", "--debug"], size)
