"""run --seeds: a run of each seed and a table of them."""

from __future__ import annotations

import argparse
import json
from xml.etree import ElementTree

import pytest

from gnss_hil.tools.command_line.arguments import seeds
from gnss_hil.tools.command_line.main import main
from tests.support.runs import summary_of

pytestmark = pytest.mark.verifies(
    "tools/study/seeds.py",
    what="Runs of several seeds",
    by="each is the run of that seed alone, and the table has its figures",
    status="validated",
)

SHORT = ("--bus", "inline", "--duration", "110", "--no-report", "--quiet")


@pytest.mark.parametrize(
    ("text", "numbers"),
    [("1:4", (1, 2, 3, 4)), ("7", (7,)), ("1:10:4", (1, 5, 9)), ("3,5,8", (3, 5, 8)), ("4:4", (4,))],
)
def test_seeds_of_a_command_line(text, numbers):
    assert seeds(text) == numbers


@pytest.mark.parametrize(
    "text", ["", "x", "5:1", "1:2:0", "1:2:3:4", "3,3", "-1:3", "1,", ":", "1:20000", "1.5:3"]
)
def test_what_is_no_range_of_seeds_is_told(text):
    with pytest.raises(argparse.ArgumentTypeError) as caught:
        seeds(text)
    assert repr(text)[1:-1] in str(caught.value)


def test_each_is_the_run_of_its_seed_and_the_table_has_its_figures(tmp_path, capsys):
    verdict = tmp_path / "verdict.xml"
    all_ = tmp_path / "all"
    expected = ("--set", 'expect."soyuz.position_error_m.median".max=0.9')
    status = main(
        ["run", "soyuz", *SHORT, *expected, "--seeds", "3:4", "--out", str(all_), "--junit", str(verdict)]
    )
    said = capsys.readouterr()
    assert main(["run", "soyuz", *SHORT, *expected, "--seed", "4", "--out", str(tmp_path / "alone")]) in (
        0,
        1,
    )
    assert (all_ / "seed-4" / "bus.log").read_bytes() == (tmp_path / "alone" / "bus.log").read_bytes()
    rows = json.loads((all_ / "seeds.json").read_text())["runs"]
    assert [row["seed"] for row in rows] == [3, 4]
    met = []
    for row in rows:
        summary = summary_of(all_ / f"seed-{row['seed']}")
        figures = summary["craft"]["soyuz"]
        assert row["fixes"] == figures["fixes"]
        assert row["max"] == figures["converged"]["position_error_m"]["max"]
        met.append(summary["expectations"][0]["met"])
        assert (row["verdict"] == "ok") is met[-1]
    assert status == (0 if all(met) else 1)
    lines = said.out.splitlines()
    assert [line.split()[0] for line in lines[:6]] == ["seed", "3", "4", "least", "mean", "greatest"]
    assert len(said.err.splitlines()) == met.count(False)
    suites = ElementTree.parse(verdict).getroot().findall("testsuite")
    assert [suite.get("name") for suite in suites] == ["gnss-hil soyuz, seed 3", "gnss-hil soyuz, seed 4"]
    assert [suite.get("failures") == "0" for suite in suites] == met


def test_a_run_of_which_nothing_is_expected_has_no_verdict(tmp_path, capsys):
    out = tmp_path / "all"
    run = ["run", "soyuz", "--bus", "inline", "--duration", "5", "--no-report", "--quiet", "--seeds", "3"]
    assert main([*run, "--out", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[1].split()[-1] == "-"
    assert [row["verdict"] for row in json.loads((out / "seeds.json").read_text())["runs"]] == ["-"]


def test_what_is_expected_of_a_fault_is_a_verdict(tmp_path, capsys):
    run = ["run", "soyuz", "--bus", "inline", "--duration", "5", "--no-report", "--quiet", "--seeds", "3"]
    fault = "rx2 off @2 fix_error_m=1000"
    main([*run, "--fault", fault, "--out", str(tmp_path / "all")])
    assert capsys.readouterr().out.splitlines()[1].split()[-1] in ("ok", "FAILED")


def test_one_that_never_began_is_told_and_the_others_are_played(tmp_path, capsys):
    out, verdict = tmp_path / "all", tmp_path / "verdict.xml"
    arguments = ["run", "soyuz", "--duration", "20", "--quiet", "--flight", "false", "--seeds", "1:2"]
    assert main([*arguments, "--out", str(out), "--junit", str(verdict)]) == 1
    err = capsys.readouterr().err.splitlines()
    assert err == [f"gnss-hil: seed {n}: flight software of soyuz ended with status 1" for n in (1, 2)]
    assert [s.get("errors") for s in ElementTree.parse(verdict).getroot().findall("testsuite")] == ["1", "1"]


@pytest.mark.parametrize("more", [("--seed", "3"), ("--set", "seed=3")])
def test_seeds_and_a_seed_contradict_each_other(more, tmp_path, capsys):
    assert main(["run", "--seeds", "1:2", *more, "--out", str(tmp_path / "all")]) == 2
    assert capsys.readouterr().err == "gnss-hil: --seeds with a seed: one of the two\n"
