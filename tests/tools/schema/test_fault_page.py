"""Kinds of faults in words, and `gnss-hil faults`."""

from __future__ import annotations

import subprocess

import pytest

from gnss_hil.emulator.faults import files
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.tools.schema import fault_page
from tests.support.programs import GNSS_HIL

pytestmark = pytest.mark.verifies(
    "tools/schema/fault_page.py",
    what="Faults: the page of kinds",
    by="every kind, key and file of the registry looked for",
    status="validated",
)


def said(*arguments: str, status: int = 0) -> str:
    done = subprocess.run([*GNSS_HIL, "faults", *arguments], capture_output=True, text=True)
    assert done.returncode == status, done.stderr
    return done.stdout + done.stderr


def test_the_page_has_every_kind_key_and_file():
    page = fault_page.page()
    for row in KINDS.values():
        assert f"| `{row.name}` | {row.summary} |" in page and row.example in page
        for name, *_ in fault_page.own_keys(row):
            assert f"`{name}` (" in page
    assert all(f"| `{name}` |" in page for name in files.shipped())


@pytest.mark.parametrize("name", KINDS)
def test_every_key_of_a_kind_has_a_meaning(name):
    assert all(meaning for _, _, _, meaning in fault_page.own_keys(KINDS[name]))


def test_list_and_show():
    listed = said("list")
    assert all(row.name in listed and row.summary in listed for row in KINDS.values())
    shown = said("show", "replay", "asymmetric")
    assert "lag" in shown and "rx2 replay 16 @40+10" in shown
    assert "not run: everybody on one bus hears the same" in shown
    assert "no kind 'replai'; did you mean 'replay'?" in said("show", "replai", status=2)


def test_check_tells_every_mistake_of_all():
    assert "1 fault, no mistake" in said("check", "replay", "rx2 off @2m+30s")
    told = said("check", "fort off", "rx2 of", "rx2 off", status=2).splitlines()
    assert told == [
        "gnss-hil: --fault 'fort off': receiver-off: no place 'fort'; did you mean 'port'?",
        "gnss-hil: --fault 'rx2 of': 'of' is no kind of fault; did you mean 'off'?",
    ]
