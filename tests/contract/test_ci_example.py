"""examples/ci does what it says: its steps are run as GitHub runs them, without privileges."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from tests.support.outside import c_tools

ROOT = Path(__file__).parents[2]
WORKFLOW = ROOT / "examples" / "ci" / "github-actions.yml"
INSTALL = "python -m pip install ."
DROP = ["setpriv", "--bounding-set=-all", "--inh-caps=-all", "--no-new-privs"]
"""Root without any of its privileges."""


def job() -> dict:
    (only,) = yaml.safe_load(WORKFLOW.read_text())["jobs"].values()
    return only


def steps() -> list[str]:
    """The commands after the installation."""
    commands = [step["run"] for step in job()["steps"] if "run" in step]
    assert commands[0] == INSTALL
    return commands[1:]


@pytest.fixture(scope="module")
def checkout(tmp_path_factory) -> Path:
    """The examples in a folder of their own, built."""
    c_tools("cc", "make", "sha256sum", "bash")
    folder = tmp_path_factory.mktemp("checkout")
    shutil.copytree(ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("build"))
    build, _ = steps()
    done = github(build, folder)
    assert done.returncode == 0, done.stderr
    return folder


def github(step: str, folder: Path) -> subprocess.CompletedProcess:
    """A step's command in GitHub's shell, with an environment that knows nothing but this bench."""
    path = f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin"
    shell = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step]
    return subprocess.run(
        [*(DROP if os.geteuid() == 0 else ()), *shell],
        cwd=folder, env={"PATH": path, "HOME": str(folder), "CI": "true"}, capture_output=True, text=True,
    )  # fmt: skip


def test_steps_have_no_privileges(tmp_path):
    done = github("grep CapEff /proc/self/status", tmp_path)
    assert done.stdout.split() == ["CapEff:", "0" * 16]


def test_the_workflow_passes_with_the_c_example(checkout):
    _, judge = steps()
    done = github(judge, checkout)
    assert done.returncode == 0, done.stderr
    suite = ElementTree.parse(checkout / "results.xml").getroot()
    assert suite.get("failures") == "0"
    assert int(suite.get("tests")) > 5
    for path in job()["steps"][-1]["with"]["path"].split():
        assert (checkout / path).stat().st_size > 0, path


def test_a_missed_expectation_fails_the_step_and_is_named(checkout):
    scenario = checkout / "examples" / "ci" / "acceptance.toml"
    asked = '"soyuz.satellites_tracked.mean" = {min = 22}'
    assert asked in scenario.read_text()
    scenario.write_text(scenario.read_text().replace(asked, asked.replace("22", "24")))
    _, judge = steps()
    done = github(judge.replace("bench-run", "second-run"), checkout)
    assert done.returncode == 1
    (line,) = (said for said in done.stderr.splitlines() if said.startswith("gnss-hil: "))  # not its progress
    assert line.startswith("gnss-hil: expectation missed: soyuz.satellites_tracked.mean: found 22.")
    assert line.endswith(", expected at least 24")
    suite = ElementTree.parse(checkout / "results.xml").getroot()
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["soyuz.satellites_tracked.mean"]
    assert (checkout / "second-run" / "report.html").stat().st_size > 0


def test_the_workflow_asks_for_no_privileges():
    document = yaml.safe_load(WORKFLOW.read_text())
    assert document["permissions"] == {"contents": "read"}
    assert job()["runs-on"] == "ubuntu-latest"
    for step in job()["steps"]:
        assert ("uses" in step) != ("run" in step)
        assert "sudo" not in step.get("run", "")
    assert job()["steps"][-1]["if"] == "always()"
