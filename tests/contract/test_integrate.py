"""docs/integrate.md is done as it says: its programs and commands, in order, in one folder."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support.outside import c_tools
from tests.support.waiting import HANG_S

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "integrate.md"

SEEN = {
    "monitor": r"040 NAV_STATUS mode=\w+ no_fix=\w+",
    "cantools decode": r"TIME_MARK\(.*TIME_GPS\(",
    "listener.py": r" 2\d ranges, centre of mass at \{'X': ",
    "fsw_c/build/fsw --duration": r"fixes +\d+ of 120 epochs",
    '"python runs/mine.py" --duration 60 --out runs/mine': r"0 lost, 0 rejected.*fixes +0 of 60 epochs",
    "orbit.oem": r"0 lost, 0 rejected.*fixes +120 of 120 epochs.*position error, 3-D +0\.000\d+ median",
    "replay": r"fixes +\d+ of 60 epochs",
    "results.xml": r"expected +soyuz\.fixes at least \d+: found 5\d\d",
}
"""What the user sees, by a phrase of the block (the last line of the script counts)."""


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block: its language, the word behind it, its lines."""

    language: str
    word: str
    text: str


def blocks() -> list[Block]:
    found = re.findall(r"^```(\w+) ?(\S*)\n(.*?)^```$", GUIDE.read_text("utf-8"), re.M | re.S)
    return [Block(*parts) for parts in found]


def run(script: str, folder: Path) -> subprocess.CompletedProcess:
    path = f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin"
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script],
        cwd=folder, env={"PATH": path, "HOME": str(folder), "LANG": "C.UTF-8"},
        capture_output=True, text=True, timeout=HANG_S,
    )  # fmt: skip


@pytest.mark.slow(seconds=80)
def test_the_guide_is_done_as_written(tmp_path):
    c_tools("cc", "make", "sha256sum", "bash")
    shutil.copytree(ROOT / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("build"))
    said, seen = "", set()
    for block in blocks():
        if block.language == "python":
            (tmp_path / block.word).write_text(block.text)
        elif block.language == "text":
            assert said == block.text
        elif block.language == "sh":
            done = run(block.text, tmp_path)
            said = done.stderr
            assert done.returncode == (1 if block.word == "fails" else 0), block.text + done.stderr
            for phrase, pattern in SEEN.items():
                if phrase in block.text:
                    seen.add(phrase)
                    assert re.search(pattern, done.stdout, re.S), done.stdout
    assert seen == set(SEEN)
    summary = json.loads((tmp_path / "runs" / "mine" / "summary.json").read_text())
    left = {path.name for path in tmp_path.iterdir() if not path.name.startswith(".")}  # caches of a home
    assert left == {"examples", "runs"}, "in a checkout git would see it"
    assert summary["reproducible"] and summary["epochs_unanswered"] == 0
    for name in ("first", "second", "third", "mine-in-c", "receiver", "replayed", "verdict", "failing"):
        assert (tmp_path / "runs" / name / "report.html").stat().st_size > 0, name


def test_what_is_not_run_says_so():
    """Sections with commands in an indented block, which are not run here, say that and why."""
    for section in re.split(r"^(?=## |\*\*)", GUIDE.read_text("utf-8"), flags=re.M):
        if re.search(
            r"^    (?:gnss-hil|git|pip) ", re.sub(r"^```.*?^```$", "", section, flags=re.M | re.S), re.M
        ):
            assert "ot tested" in " ".join(section.split()), section


def test_its_programs_are_a_third_partys():
    programs = [block for block in blocks() if block.language == "python"]
    assert [block.word for block in programs] == ["runs/listener.py", "runs/mine.py"]
    assert programs[0].text.count("\n") <= 30
    for program in programs:
        nodes = ast.walk(ast.parse(program.text))
        imports = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        assert imports - set(sys.stdlib_module_names) == {"can", "cantools"}


def test_what_it_points_to_exists():
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", GUIDE.read_text("utf-8")):
        assert os.path.exists(GUIDE.parent / target), target


def test_sections_of_the_contract_are_named_as_they_are():
    contract = (GUIDE.parent / "contract.md").read_text("utf-8")
    for name in ("Nodes", "Time", "Measurements", "Attitude", "Protection"):
        assert f"\n## {name}\n" in contract
    assert "\n## Bench frames" in contract
    for row in ("flight time", "Shapiro delay", "GLONASS"):
        assert f"\n| {row} | " in contract
