"""Two runs compared, in words and as a page in a browser."""

from __future__ import annotations

import json
import re
import shutil

import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.report_pages import drawn

pytestmark = pytest.mark.verifies(
    "tools/report/comparison/runs.py",
    "tools/report/comparison/figures.py",
    "tools/report/comparison/page.py",
    what="Two runs compared",
    by="figures of the summaries; headless Chromium draws the page",
    status="modelled",
)


def test_two_runs_compared(patent, prototype, tmp_path, capsys):
    page = tmp_path / "compared.html"
    assert main(["report", str(patent), str(prototype), "--out", str(page)]) == 0
    out = capsys.readouterr().out
    assert out.endswith(f"\nreport: {page}\n")
    first, second = (json.loads((folder / "summary.json").read_text()) for folder in (patent, prototype))
    a, b = (s["craft"]["soyuz"]["satellites_tracked"]["mean"] for s in (first, second))
    lines = out.splitlines()
    row = next(line.split() for line in lines if line.startswith("soyuz.satellites_tracked.mean"))
    assert [float(cell) for cell in row[1:4]] == pytest.approx([a, b, b / a], rel=5e-3)
    assert row[4] == "worse"
    assert lines[0] == "policy patent / prototype"
    heads = [line.split() for k, line in enumerate(lines) if k and not lines[k - 1] and "ratio" in line]
    assert all(head[-5:] == ["patent", "prototype", "ratio", "prototype", "is"] for head in heads)
    titles = [" ".join(head[:-5]) for head in heads]
    assert titles[0] == "soyuz, whole run with its cold start", "the runs end before they have converged"
    assert titles[-1].startswith("What the bench took")
    bench = [line.split() for line in lines[lines.index(next(x for x in lines if "bench took" in x)) + 1 :]]
    bench = bench[: bench.index([])]
    assert {row[0].split(".")[0] for row in bench} == {
        "real_time_factor",
        "epoch_latency_ms",
        "bus_load_percent",
    }
    assert {len(row) for row in bench} == {4}, "times are not judged"
    assert "<h1>policy patent / prototype</h1>" in page.read_text("utf-8")
    assert len(drawn(page, tmp_path)["plots"]) == 4


def test_a_run_of_another_length_is_judged_after_convergence_alone(tmp_path, capsys):
    for name, seconds in (("a", "130"), ("b", "150")):
        words = ["run", "soyuz", "--bus", "inline", "--duration", seconds, "--no-report", "--quiet"]
        assert (
            main([*words, "--policy", {"a": "patent", "b": "single"}[name], "--out", str(tmp_path / name)])
            == 0
        )
    capsys.readouterr()
    assert main(["report", str(tmp_path / "a"), str(tmp_path / "b")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("The runs are not of the same length")
    assert lines[3].startswith("soyuz after convergence"), "the honest figures come first"
    verdicts = [line.split()[0] for line in lines if line.endswith(("better", "worse"))]
    assert verdicts and all(name.startswith("soyuz.converged.") for name in verdicts)


@pytest.mark.parametrize(
    ("change", "differs"),
    [
        (["--seed", "2"], "seed (1 / 2)"),
        (["--set", "craft.0.orbit.altitude_km=500"], "orbit of soyuz"),
        (
            ["--set", "time.start_gps=2012-10-31T01:15:00"],
            "start (2012-10-31T00:15:00 / 2012-10-31T01:15:00)",
        ),
        (["--set", "sky.glonass=none"], "sky"),
        (["--set", "craft.0.name=progress"], "craft (soyuz / progress)"),
    ],
)
def test_runs_of_different_flights_are_not_judged(patent, change, differs, tmp_path, capsys):
    other = tmp_path / "other"
    words = ["run", "soyuz", "--bus", "inline", "--duration", "90", "--no-report", "--quiet"]
    assert main([*words, *change, "--out", str(other)]) == 0
    capsys.readouterr()
    page = tmp_path / "compared.html"
    assert main(["report", str(patent), str(other), "--out", str(page)]) == 0
    said = capsys.readouterr()
    why = "Nothing is judged better or worse: the runs are not of the same flight; they differ in"
    assert said.out.splitlines()[1] == f"{why} {differs}."
    assert not re.search(r"(better|worse)$", said.out.split(differs)[1], re.MULTILINE) and not said.err
    text = page.read_text("utf-8")
    assert why in text and 'class="good"' not in text and 'class="bad">better' not in text


def test_other_flight_software_and_other_errors_are_judged(patent, tmp_path, capsys):
    """A change of what one judges: the policy, the navigator, an error on the receivers."""
    other = tmp_path / "other"
    words = [
        "run",
        "soyuz",
        "--bus",
        "inline",
        "--duration",
        "90",
        "--no-report",
        "--quiet",
        "--on",
        "multipath",
    ]
    assert main([*words, "--navigator", "receiver_mean", "--out", str(other)]) == 0
    capsys.readouterr()
    assert main(["report", str(patent), str(other), "--out", str(tmp_path / "page.html")]) == 0
    assert re.search(
        r"^soyuz\.position_error_m\.\S+ .* (better|worse)$", capsys.readouterr().out, re.MULTILINE
    )


def test_a_run_that_is_compared_with_itself_is_told(patent, tmp_path, capsys):
    other, out = patent / ".." / patent.name, tmp_path / "page.html"
    assert main(["report", str(patent), str(other), "--out", str(out)]) == 0
    assert capsys.readouterr().err == f"gnss-hil: note: {other} is the same run as {patent}\n"


def test_a_comparison_goes_beside_the_first_run_unless_told(copied, prototype, capsys):
    assert main(["report", str(copied), str(prototype)]) == 0
    assert (copied / "compare-prototype.html").is_file()


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda folder: (folder / "summary.json").unlink(), "has no summary.json"),
        (lambda folder: (folder / "summary.json").write_text("[]"), "summary.json: is damaged"),
        (lambda folder: (folder / "summary.json").write_text('{"craft": {'), "summary.json: is damaged"),
        (lambda folder: (folder / "fixes.parquet").write_bytes(b"PAR1"), "fixes.parquet: not a Parquet"),
        (lambda folder: shutil.rmtree(folder), "no such run folder"),
    ],
)  # fmt: skip
def test_a_folder_that_cannot_be_compared_is_told_in_one_line(patent, copied, capsys, spoil, says):
    spoil(copied)
    assert main(["report", str(patent), str(copied)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(copied) in line and says in line
