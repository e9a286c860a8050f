"""What is expected of a run is checked before it begins."""

from __future__ import annotations

from pathlib import Path

import pytest

from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config.config import Overrides
from gnss_hil.tools.run_config.plan import make
from tests.support.programs import ROOT

pytestmark = pytest.mark.verifies(
    "tools/run_config/plan.py",
    what="What is expected of a run, checked before it",
    by="names of figures that a run has, and mistakes in them",
    status="modelled",
)

SCENARIO = """
name = "s"
time = {start_gps = "2012-10-31T00:15:00", duration_s = 100}
craft = [{name = "soyuz", vehicle = "soyuz-ms", orbit = {altitude_km = 415, inclination_deg = 51.6}}]
[expect]
"""


BROADCAST = ROOT / "examples" / "sky" / "broadcast.nav"


def nav_of(folder: Path, letter: str) -> Path:
    """The records of one system of the example's navigation file."""
    head, end, records = BROADCAST.read_text().partition("END OF HEADER\n")
    kept, keep = [], False
    for line in records.splitlines(keepends=True):
        keep = line[0] == letter if line[0] != " " else keep
        kept += [line] if keep else []
    path = folder / f"{letter}.nav"
    path.write_text(head + end + "".join(kept))
    return path


@pytest.mark.parametrize(("letter", "gone"), [("G", "GLONASS"), ("R", "GPS")])
def test_a_system_that_the_navigation_files_leave_out_is_told(tmp_path, letter, gone):
    path = nav_of(tmp_path, letter)
    found = make("soyuz", Overrides(nav=(path,), duration_s=60))
    assert found.remarks[0] == f"--nav: {path}: no {gone} record: the sky is without {gone}"
    assert gone not in "".join(make("soyuz", Overrides(nav=(BROADCAST,), duration_s=60)).remarks)


def said(tmp_path, line: str) -> str:
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO + line + "\n")
    try:
        make(str(path))
    except (Mistake, ScenarioError) as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "line",
    [
        '"soyuz.position_error_m.p95" = {max = 3, after_s = 60}',
        '"soyuz.converged.pdop.median" = {max = 3}',
        '"soyuz.no_fix.NO_ATTITUDE" = {max = 0, after_s = 99}',
        '"frames.lost" = {max = 0}',
        '"epochs_unanswered" = {max = 0}',
        '"bus_load_percent.max" = {max = 5}',
    ],
)
def test_figures_of_craft_and_run_can_be_expected(tmp_path, line):
    assert said(tmp_path, line) == ""


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('"soyuz.position_eror_m.p95" = {max = 3}', "did you mean 'soyuz.position_error_m.p95'?"),
        ('"frames.lots" = {max = 3}', "did you mean 'frames.lost'?"),
        ('"frames.lost" = {max = 0, after_s = 5}', "is of the whole run, it takes no after_s"),
        ('"soyuz.first_fix_s" = {max = 0, after_s = 5}', "is of the whole run, it takes no after_s"),
        ('"soyuz.fixes" = {min = 9, after_s = 100}', "after_s 100 leaves no epoch of a run of 100 s"),
        ('"soyuz.fixes" = {min = 9, after_s = -1}', "after_s"),
        ('"soyuz.fixes" = {}', "expects nothing; give min, max or both"),
        ('"soyuz.fixes" = {after_s = 3}', "expects nothing; give min, max or both"),
        ('"soyuz.fixes" = {min = 9, max = 8}', "min 9 is above max 8"),
    ],
)
def test_what_cannot_be_met_or_found_is_told_in_one_line(tmp_path, line, words):
    (told,) = said(tmp_path, line).splitlines()
    assert words in told
    assert "expect" in told


@pytest.mark.parametrize(
    ("options", "words"),
    [((), "fixes are by one signal"), ((("without_pairs", "no-fix"),), "other_signals: no fix")],
)
def test_two_carriers_of_a_vehicle_of_one_are_remarked_on(options, words):
    (line,) = make("soyuz", Overrides(ionosphere_free=True, options=options)).remarks
    assert line.startswith("craft soyuz: ionosphere_free: vehicle 'soyuz-ms'") and words in line
    assert make("soyuz").remarks == ()
    both = make("soyuz", Overrides(ionosphere_free=True, vehicle="soyuz-ms-l1l2"))
    assert both.remarks == () and both.flights[0].second.any()


def test_another_policy_leaves_two_carriers_what_they_were_asked_for():
    plan = make("soyuz-l1l2", Overrides(policy="prototype", ionosphere_free=True))
    assert plan.flights[0].options.ionosphere_free
    assert not make("soyuz-l1l2", Overrides(policy="prototype")).flights[0].options.ionosphere_free
