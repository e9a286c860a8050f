"""gnss-hil completion: what a real bash completes."""

from __future__ import annotations

import shlex
import shutil
import subprocess

import pytest

from gnss_hil.tools.command_line import completion
from gnss_hil.tools.command_line.main import COMMANDS, main, parser_of
from gnss_hil.tools.commands.icd import PARTS

pytestmark = pytest.mark.verifies(
    "tools/command_line/completion.py",
    what="Completion for shells",
    by="bash, asked for its completions; of zsh and fish the words alone",
    status="validated",
)

BASH = shutil.which("bash")


@pytest.fixture(scope="module")
def scripts() -> dict[str, str]:
    return {shell: completion.script(shell) for shell in ("bash", "zsh", "fish")}


def completed(script: str, typed: list[str], folder) -> list[str]:
    """What bash offers for the last of the words."""
    assert BASH
    words = " ".join(map(shlex.quote, typed))
    ask = (
        f"COMP_WORDS=({words}); COMP_CWORD={len(typed) - 1}; _gnss_hil; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    )
    done = subprocess.run(
        [BASH, "-c", f"{script}\n{ask}"], capture_output=True, text=True, check=True, cwd=folder
    )
    assert done.stderr == ""
    return [line for line in done.stdout.splitlines() if line]


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (["ru"], ["run"]),
        (["run", "--pol"], ["--policy"]),
        (["run", "--policy", "p"], ["patent", "prototype"]),
        (["run", "soyuz", "--on", "cycle"], ["cycle_slips"]),
        (["run", "--duration", "1"], []),
        (["run", "--navigator", "all"], ["all_in_view"]),
        (["export", "o"], ["oem"]),
        (["icd", "h"], ["html", "hash"]),
        (["replay", "--only", ""], ["emulator", "flight"]),
        (["convert", "my"], ["my run.log"]),
        (["run", "my"], ["my run.log"]),
        (["run", "--vehicle", "iss-t"], ["iss-two-antennas"]),
        (["nothing", "x"], []),
    ],
)
def test_what_bash_offers(scripts, tmp_path, typed, offered):
    (tmp_path / "my run.log").touch()
    assert completed(scripts["bash"], ["gnss-hil", *typed], tmp_path) == offered


def test_every_command_and_option_is_offered(scripts, tmp_path):
    assert set(COMMANDS) <= set(completed(scripts["bash"], ["gnss-hil", ""], tmp_path))
    for command in COMMANDS.values():
        options = {name for action in parser_of(command)._actions for name in action.option_strings}
        assert options <= set(completed(scripts["bash"], ["gnss-hil", command.name, ""], tmp_path))
        for name in options:
            assert name in scripts["zsh"]
            assert f"-l {name[2:]}" in scripts["fish"] or f"-s {name[1:]}" in scripts["fish"]


def test_parts_of_the_icd_are_those_there_are():
    assert completion._known()["part"] == PARTS


def test_the_command_writes_the_script(scripts, capsys):
    assert main(["completion", "bash"]) == 0
    assert capsys.readouterr().out == scripts["bash"]
    assert main(["completion", "csh"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
