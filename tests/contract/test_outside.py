"""Nothing skips in silence: what a machine may lack is asked for in one place, and CI requires all of it."""

from __future__ import annotations

import re

import pytest

from tests.support import outside
from tests.support.programs import ROOT

SKIPS = re.compile(r"importorskip|skipif|pytest\.skip\(")

ALLOWED = {
    "tests/support/outside.py": "the one place",
    "tests/contract/test_outside.py": "looks for them",
    "tests/conformance/test_links.py": "a bus that nothing can take away",
    "tests/system/test_cangw_inside.py": "played by test_socketcan where a kernel has no CAN",
    "tests/system/test_deaths.py": "a device of Linux that is always full",
    "tests/system/test_output.py": "a device of Linux that is always full",
    "tests/system/test_receiver_py_inside.py": "played by test_socketcan where a kernel has no CAN",
    "tests/system/test_replay_inside.py": "played by test_socketcan where a kernel has no CAN",
    "tests/system/test_socketcan_inside.py": "played by test_socketcan where a kernel has no CAN",
}


def test_tests_skip_in_one_place():
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "tests").rglob("*.py")
        if SKIPS.search(path.read_text("utf-8"))
    }
    assert found == set(ALLOWED)


def test_ci_requires_all_of_it():
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    assert set(re.findall(r"GNSS_HIL_REQUIRE_(\w+)=1", script)) == set(outside.NEEDS)


@pytest.mark.parametrize("required", [False, True])
def test_a_package_that_is_missing_skips_or_fails(monkeypatch, required):
    monkeypatch.setenv("GNSS_HIL_REQUIRE_PEERS", "1" if required else "")
    with pytest.raises(pytest.fail.Exception if required else pytest.skip.Exception, match="no_such_package"):
        outside.peer("no_such_package")


def test_what_nobody_requires_is_no_reason():
    with pytest.raises(KeyError):
        outside.missing("WEATHER", "rain")
