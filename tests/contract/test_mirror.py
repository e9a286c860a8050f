"""The tests of a module are where the module is: tests/<package>/<room>/test_<module>[_<aspect>].py.

A module without a file of its name has a line in mirror.toml, which says what file tests it.
"""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest

from tests.support.programs import ROOT
from tests.verification.rows import rows

PACKAGES = ("dbc", "emulator", "flightsw", "tools")

ACROSS = {
    "emulator/constellation/broadcast/test_user_algorithms.py": "gps, glonass and ephemerides",
    "emulator/error_models/test_thermal_noise.py": "noise of codes, rates and phases",
    "emulator/receivers/recorded/test_group_delays.py": "receiver and signals",
    "emulator/receivers/emulated/test_second_carriers.py": "what receivers of two carriers measure and obey",
    "emulator/sensors/test_made_up.py": "what a sensor of somebody else's takes",
    "emulator/signal/ionosphere/test_relative.py": "all ionosphere models beside each other",
    "emulator/faults/kinds/test_kinds.py": "what kinds do to frames",
    "emulator/test_process.py": "the emulator as a process",
    "flightsw/app/test_fuzz.py": "the whole flight software under random frames",
    "flightsw/estimation/test_navigators.py": "all navigators beside each other",
    "flightsw/estimation/test_seam.py": "what a navigator is asked for, by one of the test's own",
    "emulator/receivers/test_kinds.py": "which kind of receivers a craft gets",
    "emulator/receivers/test_made_up_kind.py": "a kind of receivers that is nowhere else",
    "flightsw/test_process.py": "the flight software as a process",
    "tools/export/test_command.py": "gnss-hil export",
    "tools/export/test_courses.py": "sp3, oem and time series",
    "tools/icd/test_browser.py": "the page in a browser",
    "tools/icd/test_command.py": "gnss-hil icd",
    "tools/icd/test_document.py": "the document of all chapters",
    "tools/monitor/test_monitor.py": "gnss-hil monitor",
    "tools/packaging/test_container.py": "the Containerfile",
    "tools/packaging/test_wheel.py": "what a wheel holds",
    "tools/report/test_palette.py": "colours of all figures",
    "tools/results/test_timeline.py": "tables and text along a run",
    "tools/run_config/test_switches.py": "--on and --off",
}
"""Test files of a room's modules together, or of the room's command, and what they test."""


def across(file: str) -> bool:
    """Whether there is no module that a test file is named after."""
    folder, _, name = file.rpartition("/")
    parts = name.removeprefix("test_").removesuffix(".py").split("_")
    stems = {"_".join(parts[:count]) for count in range(1, len(parts) + 1)}
    return not any(
        (ROOT / folder / stem).is_dir() or (ROOT / folder / f"{stem}.py").is_file() for stem in stems
    )


def test_every_test_file_is_named_after_a_module_or_listed():
    files = (path.relative_to(ROOT / "tests").as_posix() for path in (ROOT / "tests").rglob("test_*.py"))
    assert {file for file in files if file.split("/")[0] in PACKAGES and across(file)} == set(ACROSS)


NOTHING_TO_TEST = {
    "dbc/common/arrays.py": "names of array types",
    "dbc/common/limits.py": "two numbers of the contract",
    "tools/common/ticker.py": "a line that says how far a long piece of work is",
    "tools/packaging/link_tree.py": "how the package is built: the tests of installs see it",
    "tools/packaging/package.py": "how the package is built: the tests of installs see it",
    "tools/packaging/plotly_script.py": "how the package is built: the tests of installs see it",
}

MIRROR = {
    f"{folder}/{module}": file
    for folder, files in tomllib.loads(Path(__file__).with_name("mirror.toml").read_text("utf-8")).items()
    for module, file in files.items()
}
"""Module without a file of its name -> the test file that tests it."""


def modules() -> set[str]:
    """All modules but those that make a folder a package."""
    return {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if path.name != "__init__.py"
    }


def has_file_of_its_name(module: str) -> bool:
    folder, stem = (ROOT / "tests" / module).parent, Path(module).stem
    return any(folder.glob(f"test_{stem}.py")) or any(folder.glob(f"test_{stem}_*.py"))


def test_every_module_has_a_test_file_of_its_name_or_is_listed():
    assert {m for m in modules() if not has_file_of_its_name(m)} == MIRROR.keys() | NOTHING_TO_TEST.keys()


def imported(file: Path) -> set[str]:
    """Modules that a file names in its imports."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return {name.removeprefix("gnss_hil.").replace(".", "/") + ".py" for name in found}


@pytest.mark.parametrize("module", MIRROR)
def test_what_a_module_is_listed_under_tests_it(module):
    """It imports it, says in a marker that it judges it, or plays the command by its name."""
    file = ROOT / "tests" / MIRROR[module]
    judged = {
        place
        for row in rows()
        for place in row.where
        if any(test.split("::")[0] == f"tests/{MIRROR[module]}" for test in row.tests)
    }
    assert module in imported(file) | judged or (
        module.startswith("tools/commands/")
        and re.search(rf"\b{Path(module).stem}\b", file.read_text("utf-8"))
    )


PAUSES = re.compile(
    r"time\.sleep|\bmonotonic|perf_counter|process_time|timeout=\d|timeout_s=\d\d|\.wait\(\d|\.join\(\d"
)
"""Waiting for a time, and looking at one."""

ALLOWED = {
    "tests/support/waiting.py": "the one place that waits",
    "tests/dbc/lockstep/test_master_loop.py": "a clock of the test's own",
    "tests/support/every_kind.py": "looks at memory each second, until the bench has ended",
    "tests/support/terminals.py": "waits for what is drawn, until HANG_S",
    "tests/conformance/test_links.py": "waits for frames until HANG_S; receive(0.2) lasts 0.2 s at least",
    "tests/conformance/test_embedded.py": "python-can's own limit of a held-back sender",
    "tests/system/test_receiver_py.py": "rubbish in a rhythm of its own",
    "tests/system/test_socketcan.py": "a limit of five seconds, which a command is to outlast",
    "tests/system/test_foreign.py": "a player of its own rhythm",
    "tests/system/test_lockstep_threads.py": "fifty epochs at a pace last half a second at least",
    "tests/system/test_run.py": "forty epochs at a pace last two seconds at least",
    "tests/system/test_socketcan_inside.py": "a paced link takes 0.12 s at least",
}


def test_nothing_judges_by_the_clock():
    """On a busy machine all takes longer: tests wait for states. Least times alone may be asked for."""
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "tests").rglob("*.py")
        if PAUSES.search(path.read_text("utf-8")) and not path.is_relative_to(ROOT / "tests" / "benchmarks")
    }
    assert found - {"tests/contract/test_mirror.py", "tests/results/__main__.py"} == set(ALLOWED)


@pytest.mark.parametrize(("file", "alone"), [("dbc/bus/test_hub.py", False), ("dbc/bus/test_no.py", True)])
def test_a_module_is_found_by_its_name(file, alone):
    assert across(file) == alone
