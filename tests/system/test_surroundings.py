"""A user's own modules, beside a program, in the working directory, on PYTHONPATH: no harm, no loss."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

GNSS_HIL = Path(sys.executable).parent / "gnss-hil"

OURS = ("dbc", "emulator", "flightsw", "tools")

PROGRAM = """\
import os, sys
import dbc.mine, emulator, flightsw.mine, tools
from gnss_hil.dbc.contract.codec import codec

assert codec(4).hash and dbc.mine.OWNER == emulator.OWNER == flightsw.mine.OWNER == tools.OWNER == "user"
open(sys.argv[1], "w").write("here")
bus, vehicle = os.environ["GNSS_HIL_BUS"], os.environ["GNSS_HIL_VEHICLE"]
os.execv(sys.executable, [sys.executable, "-P", "-m", "gnss_hil.flightsw", "--vehicle", vehicle, "--bus", bus,
                          "--once", "--quiet"])
"""


def run(*arguments, cwd, **environment):
    return subprocess.run(
        [GNSS_HIL, *map(str, arguments)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
    )


@pytest.fixture
def project(tmp_path):
    """A project that has all four names: folders with and without `__init__.py`, and modules."""
    for package in ("dbc", "flightsw"):
        (tmp_path / "project" / package).mkdir(parents=True)
        (tmp_path / "project" / package / "mine.py").write_text('OWNER = "user"\n')
    for module in ("emulator", "tools"):
        (tmp_path / "project" / f"{module}.py").write_text('OWNER = "user"\n')
    (tmp_path / "project" / "program.py").write_text(PROGRAM)
    return tmp_path / "project"


@pytest.fixture
def traps(tmp_path):
    """Modules and packages of all four names, and of others that a process needs, that fail when imported."""
    folder = tmp_path / "traps"
    for name in (*OURS, "gnss", "report", "select", "queue", "numpy"):
        folder.mkdir(exist_ok=True)
        (folder / f"{name}.py").write_text(f'raise ImportError("{name} of the user was imported")\n')
    return folder


def test_a_program_with_modules_of_our_names_flies(project, tmp_path):
    done = run(
        "run", "soyuz", "--duration", 3, "--quiet", "--no-report", "--out", tmp_path / "run",
        "--flight", f"{sys.executable} {project / 'program.py'} {tmp_path / 'seen'}", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "seen").read_text() == "here"


@pytest.mark.parametrize("bus", ["embedded", "inline"])
def test_the_working_directory_is_not_imported(bus, traps, tmp_path):
    done = run("run", "soyuz", "--duration", 3, "--bus", bus, "--quiet", "--out", tmp_path / "run", cwd=traps)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("bus", ["embedded", "inline"])
def test_our_names_on_the_path_of_modules_are_left_alone(bus, traps, tmp_path):
    for name in ("gnss", "report", "select", "queue", "numpy"):
        (traps / f"{name}.py").unlink()
    done = run(
        "run", "soyuz", "--duration", 3, "--bus", bus, "--quiet", "--no-report", "--out", tmp_path / "run",
        cwd=tmp_path, PYTHONPATH=str(traps),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", OURS)
def test_no_name_of_ours_but_one(name, tmp_path):
    """`import tools` of a user who has none says so."""
    done = subprocess.run(
        [sys.executable, "-c", f"import {name}"], cwd=tmp_path, capture_output=True, text=True
    )
    assert f"No module named '{name}'" in done.stderr
