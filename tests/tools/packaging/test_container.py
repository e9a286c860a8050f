"""The Containerfile, read as an engine reads it, and its steps that need no engine."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys

import pytest

from gnss_hil.tools.command_line.main import COMMANDS
from tests.support.programs import ROOT

FILE = ROOT / "tools" / "packaging" / "Containerfile"


def instructions() -> list[tuple[str, str]]:
    """Instruction and argument, in order; comments out, continued lines joined."""
    lines = (line for line in FILE.read_text("utf-8").splitlines() if not line.lstrip().startswith("#"))
    joined = "\n".join(lines).replace("\\\n", " ")
    return [(word, rest) for word, _, rest in (line.partition(" ") for line in joined.splitlines() if line)]


def arguments_of(instruction: str) -> list[str]:
    return [argument for word, argument in instructions() if word == instruction]


def stages() -> list[list[tuple[str, str]]]:
    found: list[list[tuple[str, str]]] = []
    for word, argument in instructions():
        if word == "FROM":
            found.append([])
        found[-1].append((word, argument))
    return found


def test_bases_are_pinned_and_have_a_python_that_is_allowed():
    bases = {argument.split()[0] for argument in arguments_of("FROM")}
    (base,) = bases
    version = re.fullmatch(r"docker\.io/library/python:(\d+)\.(\d+)\.(\d+)-slim-[a-z]+", base)
    assert version, base
    assert (int(version[1]), int(version[2])) == (3, 11)  # of which constraints.txt is


def test_what_runs_is_nobody_special_and_the_program_itself():
    last = stages()[-1]
    words = [word for word, _ in last]
    assert {"ADD", "EXPOSE", "ENV", "SHELL"}.isdisjoint(word for word, _ in instructions())
    (user,) = (argument for word, argument in last if word == "USER")
    assert user.isdigit() and int(user) > 0
    assert words.index("USER") > max(k for k, word in enumerate(words) if word == "RUN")
    (entry,) = (json.loads(argument) for word, argument in last if word == "ENTRYPOINT")
    (command,) = (json.loads(argument) for word, argument in last if word == "CMD")
    assert entry == ["gnss-hil"] and command[0] in COMMANDS


def test_nothing_is_taken_from_the_network_when_it_is_installed_or_run():
    """The last stage installs what the first collected, of the versions in constraints.txt."""
    first, last = stages()
    (collects,) = (argument for word, argument in first if word == "RUN")
    assert "--constraint tools/packaging/constraints.txt" in collects
    installs = [argument for word, argument in last if word == "RUN"]
    assert installs and all("--no-index" in argument for argument in installs if "pip " in argument)
    assert not re.search(r"\b(curl|wget|apt-get|git|https?:)\b", FILE.read_text("utf-8"))


def test_what_is_copied_is_there_and_is_what_a_build_needs(tmp_path):
    """The package is built of it alone: no file outside of what is copied is missed."""
    for argument in arguments_of("COPY"):
        *sources, target = argument.split()
        for source in sources:
            here = ROOT / source
            there = tmp_path / target / ("" if here.is_dir() else source)
            if here.is_dir():
                shutil.copytree(here, there, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(here, there)
    build = "import hatchling.build as h, sys; h.build_wheel(sys.argv[1])"
    subprocess.run(
        [sys.executable, "-c", build, str(tmp_path)], cwd=tmp_path, check=True, capture_output=True
    )
    assert list(tmp_path.glob("gnss_hil-*.whl"))


NAMELESS = """
import pwd, sys
def unknown(uid):
    raise KeyError(f"getpwuid(): uid not found: {uid}")
pwd.getpwuid = unknown
from gnss_hil.tools.command_line.main import main
sys.exit(main(sys.argv[1:]))
"""


def test_a_user_without_a_name_or_a_home_flies(tmp_path):
    """As engines run it with `--user 12345`."""
    folder = tmp_path / "run"
    command = [sys.executable, "-c", NAMELESS, "run", "soyuz", "--duration", "5", "--out", str(folder)]
    environment = {"PATH": os.environ["PATH"], "HOME": "/nowhere", "TMPDIR": str(tmp_path)}
    done = subprocess.run([*command, "--quiet"], env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / "report.html").is_file()


@pytest.mark.parametrize("required", ["", "1"])
def test_without_an_engine_ci_says_so(required):
    environment = {"PATH": "/nowhere", "GNSS_HIL_REQUIRE_CONTAINER": required}
    done = subprocess.run(
        ["/bin/bash", "-c", f"PATH=/nowhere; dirname() {{ echo {shlex.quote(str(ROOT / '.ci'))}; }}; "
         f". {shlex.quote(str(ROOT / '.ci' / 'container'))}"],
        env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.stderr == "THE CONTAINER WAS NOT BUILT: neither podman nor docker works here\n"
    assert done.returncode == (1 if required else 0)
