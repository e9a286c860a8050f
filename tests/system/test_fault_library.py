"""The library flown against our own flight software: each file judged by its own expectations."""

from __future__ import annotations

import pytest

from gnss_hil.emulator.faults import files
from tests.results import fault_library

pytestmark = [
    pytest.mark.slow,
    pytest.mark.verifies(
        "tools/results/fault_verdicts.py",
        what="Faults: what each of the library does to our flight software",
        by="what contract and physics demand, told in each file",
        status="validated",
    ),
]

COMMANDS = {"ack-lost", "command-altered", "command-doubled", "command-late", "command-lost"}


@pytest.mark.parametrize("name", files.shipped())
def test_a_fault_leads_to_what_its_file_expects(name, tmp_path):
    row = fault_library.fly(name, tmp_path)
    missed = [one for one in row["expectations"] if not one["met"]]
    assert row["first_epoch"] is not None, "it never acted"
    assert not missed and row["met"] and row["expectations"]


@pytest.mark.parametrize("name", files.shipped())
def test_every_file_expects_what_can_be_missed(name):
    """A check that sees it and when, or that none does; and metres, or epochs with a fix."""
    expect = fault_library.fault_of(name).expect
    assert expect.detected_by and ("none" not in expect.detected_by or len(expect.detected_by) == 1)
    assert (expect.within_epochs is None) == (expect.detected_by == ("none",))
    assert expect.fix_error_m is not None or expect.availability


def test_the_page_is_of_the_files_that_ship():
    """Kept is what was found by the expectations that the files have now."""
    kept = fault_library.read()["files"]
    assert list(kept) == sorted(files.shipped())
    for name, row in kept.items():
        said = {one["key"]: one["expected"] for one in row["expectations"]}
        expect = fault_library.fault_of(name).expect
        assert set(said) == expect.model_fields_set - {"within_epochs"} and row["met"], name
        if expect.fix_error_m is not None:
            assert said["fix_error_m"] == f"<= {expect.fix_error_m:g}"
