"""report.html in a real browser, and what becomes of it where something is missing."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.tools.command_line.main import main
from tests.support import browser

pytestmark = [
    pytest.mark.verifies(
        "tools/report/run_report.py",
        "tools/report/craft.py",
        "tools/report/time_series.py",
        "tools/report/ground_track.py",
        "tools/report/plot.py",
        "tools/report/summary_tables.py",
        "tools/report/compare.py",
        "tools/report/channels.py",
        what="Report: what its plots and tables show",
        by="choice of ours; values come from the tables of the run",
        status="modelled",
    ),
    pytest.mark.verifies(
        "tools/report/document.py",
        what="Report as drawn",
        by="headless Chromium: no script error, no request, every plot drawn",
        status="validated",
    ),
]

TITLES = (
    "Assignment", "Sky of antenna fore", "Sky of antenna starboard", "Sky of antenna aft",
    "Sky of antenna port", "Position error", "Velocity error", "Normalised squared error", "Receiver clock",
    "Attitude", "Residuals", "Satellites by antenna", "Satellites", "Dilution of precision", "Ground track",
    "Orbit", "Carrier to noise density", "Bus load", "Latency of an epoch", "Commands and faults",
)  # fmt: skip


SKIES = TITLES[1:5]


def played(folder: Path, *more: str) -> Path:
    assert (
        main(["run", "soyuz", "--bus", "inline", "--duration", "90", "--quiet", "--out", str(folder), *more])
        == 0
    )
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return played(tmp_path_factory.mktemp("report") / "patent")


@pytest.fixture(scope="module")
def prototype(tmp_path_factory) -> Path:
    return played(tmp_path_factory.mktemp("report") / "prototype", "--policy", "prototype")


@pytest.fixture
def copied(run, tmp_path) -> Path:
    return Path(shutil.copytree(run, tmp_path / "copy"))


def drawn(page: Path, folder: Path, **how) -> dict:
    """A page that was drawn whole, without a word of complaint and without asking anybody for anything."""
    browser.require()
    seen = browser.look(page, folder, **how)
    assert seen.complaints == []
    assert seen.probe is not None, "the page never finished drawing"
    for plot in seen.probe["plots"]:
        assert plot["surfaces"] and plot["traces"], plot
    assert not [address for address in seen.probe["addresses"] + seen.probe["fetched"] if "//" in address]
    return seen.probe


def titles(page: Path) -> list[str]:
    return re.findall(r"<figcaption><h3>([^<]*)</h3>", page.read_text("utf-8"))


def test_every_plot_of_a_run_is_drawn(run, tmp_path):
    page = run / "report.html"
    assert page.stat().st_size < 3_000_000
    assert titles(page) == list(TITLES)
    probe = drawn(page, tmp_path)
    assert len(probe["plots"]) == len(TITLES)
    assert probe["scroll"] <= probe["width"] == 1200
    assert probe["cut"] == 0, "a table is cut off"
    spans = {tuple(plot["time"]) for plot in probe["plots"] if plot["time"]}
    assert len(spans) == 1, "plots over time show different stretches"


def test_satellites_of_two_carriers_have_a_row_where_there_are_any(run, tmp_path):
    assert "of them by two carriers" not in (run / "report.html").read_text("utf-8")
    words = ["--vehicle", "soyuz-ms-l1l2", "--ionosphere-free"]
    assert "of them by two carriers" in (played(tmp_path / "two", *words) / "report.html").read_text("utf-8")


def test_a_narrow_window_needs_no_sideways_scrolling(run, tmp_path):
    probe = drawn(run / "report.html", tmp_path, width=600, scheme=browser.DARK)
    assert probe["scroll"] <= probe["width"] == 600
    assert probe["colour"] == "dark"


@pytest.mark.parametrize("width", [500, 800, 1400])
def test_figures_fit_every_window_and_skies_leave_no_blank(run, tmp_path, width):
    probe = drawn(run / "report.html", tmp_path, width=width)
    assert probe["scroll"] <= probe["width"] == width
    assert probe["cut"] == probe["told"] == 0
    assert len(probe["round"]) == len(SKIES)
    assert all(tall <= wide + 2 or tall == 400 for wide, tall in probe["round"])


def test_a_table_that_is_cut_off_says_so(tmp_path):
    """A shade, words below, its first column in place, keys that scroll it; nothing where all is seen."""
    from gnss_hil.tools.report.document import Page, card
    from gnss_hil.tools.report.markup import table

    page = Page("wide")
    wide = table([f"column {k}" for k in range(9)], [[f"cell-number-{k}" for k in range(9)]])
    page.add(card("Wide", wide), card("Narrow", table(("a", "b"), [("1", "2")])))
    page.write(tmp_path / "wide.html")
    narrow, broad = (browser_look(tmp_path / "wide.html", tmp_path, width) for width in (600, 1800))
    assert (narrow["cut"], narrow["told"], narrow["stays"]) == (1, 1, True)
    assert (broad["cut"], broad["told"]) == (0, 0)


def browser_look(page: Path, folder: Path, width: int) -> dict:
    """A page without plots in a window."""
    browser.require()
    seen = browser.look(page, folder, width=width)
    assert seen.complaints == [] and seen.probe is not None
    return seen.probe


def test_light_and_dark_are_two_pictures_and_neither_is_blank(run, tmp_path):
    browser.require()
    light, dark = (
        browser.screenshot(run / "report.html", tmp_path, scheme) for scheme in (browser.LIGHT, browser.DARK)
    )
    assert light.shape == dark.shape
    for picture in (light, dark):
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200
    assert np.median(light) > 200 > 60 > np.median(dark)


def test_a_page_is_printed_whole_as_soon_as_it_is_loaded(run, tmp_path):
    """Plots are there at the load event, and as wide as the paper before a print begins."""
    probe = drawn(run / "report.html", tmp_path, width=1400)
    assert len(probe["loaded"]) == len(TITLES) and min(probe["loaded"]) > 300
    assert {*probe["printed"]} == {664}
    assert browser.strokes(run / "report.html", tmp_path) > 1000


def test_a_met_and_a_missed_expectation_differ_in_colour():
    from gnss_hil.tools.report.summary_tables import expectations

    rows = [
        {"name": "a", "min": 1, "found": 2, "met": True},
        {"name": "b", "max": 1, "found": 2, "met": False},
    ]
    text = expectations({"expectations": rows})
    assert '<b class="good">met</b>' in text and '<b class="bad">MISSED</b>' in text


def test_a_run_without_faults_and_expectations_has_no_empty_card(run):
    page = (run / "report.html").read_text("utf-8")
    assert "Frame faults</h3>" not in page and "Expectations</h3>" not in page
    assert "expects nothing" in page and "No frame was lost" in page


def test_a_page_that_fails_is_noticed(run, tmp_path):
    """The tests above would see an exception, a plot that is not drawn, and a stranger's address."""
    browser.require()
    whole = (run / "report.html").read_text("utf-8")
    broken = tmp_path / "broken.html"
    broken.write_text(whole.replace("return Plotly.react(", "return Plotly.refract("), "utf-8")
    seen = browser.look(broken, tmp_path)
    assert seen.probe is None and "refract" in "".join(seen.complaints)
    calling = tmp_path / "calling.html"
    calling.write_text(whole.replace("</main>", '<img src="http://example.com/a.png"></main>'), "utf-8")
    seen = browser.look(calling, tmp_path)
    assert "Content Security Policy" in "".join(seen.complaints)  # the page's own, before any network
    assert "http://example.com/a.png" in seen.probe["addresses"]


def test_two_craft_have_their_relative_position(tmp_path):
    folder = tmp_path / "pair"
    assert main(["run", "pair", "--bus", "inline", "--duration", "120", "--quiet", "--out", str(folder)]) == 0
    page = folder / "report.html"
    names = titles(page)
    assert names.count("Velocity error") == 2 and names[-1] == "Latency of an epoch"
    assert "passive from active" in names
    drawn(page, tmp_path)


def test_satellites_on_several_antennas_at_once_are_told(prototype, run):
    assert re.search(
        r"several antennas held the satellite at once: \d+ satellites",
        (prototype / "report.html").read_text(),
    )
    assert "Diamonds are handovers" in (run / "report.html").read_text()


def test_without_truth_the_page_says_so_and_draws_the_rest(copied, tmp_path, capsys):
    (copied / "truth").unlink()
    assert main(["report", str(copied)]) == 0
    assert capsys.readouterr().out.endswith(f"\nreport:     {copied}/report.html\n")
    text = (copied / "report.html").read_text("utf-8")
    assert "No truth was kept with this run" in text
    assert len(drawn(copied / "report.html", tmp_path)["plots"]) == len(TITLES) - 3


def test_without_a_log_the_page_shows_fixes_and_truth(tmp_path):
    folder = played(tmp_path / "bare", "--no-log")
    text = (folder / "report.html").read_text("utf-8")
    assert "has no table of channels" in text
    assert text.count("This run kept no table of channels") == 5
    assert "Not drawn" in text
    without = {"Assignment", "Carrier to noise density", "Residuals", "Satellites by antenna", *SKIES}
    assert titles(folder / "report.html") == [title for title in TITLES if title not in without]
    assert len(drawn(folder / "report.html", tmp_path)["plots"]) == len(TITLES) - len(without)


def test_a_run_without_a_fix_has_a_page(copied, tmp_path):
    """A flight software that never publishes: its frames are taken out of the record."""
    lines = (copied / "bus.log").read_bytes().splitlines(keepends=True)
    kept = [line for line in lines if not re.search(rb" can0 0[24]", line)]
    assert len(kept) < len(lines)
    (copied / "bus.log").write_bytes(b"".join(kept))
    assert main(["report", str(copied)]) == 0
    text = (copied / "report.html").read_text("utf-8")
    assert text.count("There is not one valid fix in this run.") == 5
    drawn(copied / "report.html", tmp_path)


def test_a_flight_software_that_sends_no_lists_is_not_shown_with_0_satellites(run, copied, tmp_path, capsys):
    lines = (copied / "bus.log").read_bytes().splitlines(keepends=True)
    kept = [line for line in lines if b" can0 04B#" not in line]
    assert len(kept) < len(lines)
    (copied / "bus.log").write_bytes(b"".join(kept))
    assert main(["report", str(copied)]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^  not sent +NAV_USED \(satellites as NAV_STATUS counts them\)$", out, re.MULTILINE)
    assert re.search(r"^  PDOP, each satellite once +-$", out, re.MULTILINE)
    whole, bare = (json.loads((folder / "summary.json").read_text()) for folder in (run, copied))
    whole, bare = (s["craft"]["soyuz"]["satellites_tracked"] for s in (whole, bare))
    assert bare == whole and bare["min"] >= 4
    text = (copied / "report.html").read_text("utf-8")
    assert "Not sent with its fixes: NAV_USED" in text
    assert f"<b>{whole['mean']:.1f}</b><span>satellites in the fix" in text
    assert "rms of all, as fixes do not say" in text
    drawn(copied / "report.html", tmp_path)


def test_a_run_of_which_nothing_was_heard_has_a_page(copied, tmp_path):
    (copied / "bus.log").write_bytes(b"")
    assert main(["report", str(copied)]) == 0
    assert "No time mark was heard." in (copied / "report.html").read_text("utf-8")
    drawn(copied / "report.html", tmp_path)


def test_refused_frames_have_a_plot_and_a_table(copied, tmp_path):
    log = (copied / "bus.log").read_bytes().splitlines(keepends=True)
    at = [i for i, line in enumerate(log) if b" can0 100#" in line][10]
    log[at] = log[at][:-4] + (b"00" if log[at][-4:-2] != b"00" else b"11") + log[at][-2:]
    (copied / "bus.log").write_bytes(b"".join(log))
    assert main(["report", str(copied)]) == 0
    page = copied / "report.html"
    assert "refused: corrupted" in page.read_text("utf-8")
    assert titles(page) == [*TITLES, "Frames refused"]
    drawn(page, tmp_path)


def test_a_run_may_go_without_a_page(tmp_path, capsys):
    folder = played(tmp_path / "plain", "--no-report")
    assert not (folder / "report.html").exists()
    assert capsys.readouterr().out.endswith(f"run folder: {folder}\n"), "no line of a page"
    assert (
        main(["run", "soyuz", "--bus", "inline", "--duration", "9", "--no-report", "--out", f"{folder}2"])
        == 0
    )
    assert capsys.readouterr().out.endswith(f"run folder: {folder}2\n")


def test_a_page_that_cannot_be_written_costs_nothing_else(copied, capsys):
    (copied / "report.html").unlink()
    (copied / "report.html").mkdir()
    before = json.loads((copied / "summary.json").read_text())
    (copied / "summary.json").unlink()
    assert main(["report", str(copied)]) == 1
    written = capsys.readouterr()
    (line,) = written.err.splitlines()
    assert f"{copied}/report.html" in line and "summary.json" in line
    assert json.loads((copied / "summary.json").read_text()) == before
    assert not list(copied.glob(".*"))


def test_outages_are_counted_and_shaded(run):
    """A cold start: 36 epochs without a fix, one shade."""
    from gnss_hil.dbc.common import vehicle
    from gnss_hil.tools.report import error_plots
    from gnss_hil.tools.report.craft import gather
    from gnss_hil.tools.results import assemble, run_digest, truth

    scenario, codecs = assemble.read_scenario(run)
    names = [craft.name for craft in scenario.craft]
    digest = run_digest.from_log(run / "bus.log", names, codecs)["soyuz"]
    craft = gather(
        "soyuz", vehicle.load(run / "vehicle.toml"), 1.0, digest, truth.read(run / "truth").rows, None
    )
    figure = error_plots.position_error(craft).figure
    (shade,) = figure["layout"]["shapes"]
    assert shade["x1"] - shade["x0"] == 36_000
    page = (run / "report.html").read_text("utf-8")
    assert "too few satellites" in page
    assert "First fix 36 s after the first epoch." in page


def test_many_short_outages_become_few_shades():
    from types import SimpleNamespace

    from gnss_hil.tools.report import time_series
    from gnss_hil.tools.results.outages import stretches

    t_ns = np.arange(86_400) * 10**9
    fix = t_ns[::2]
    fixes = {"t_ns": fix, "valid": np.ones(len(fix), bool), "no_fix": np.zeros(len(fix))}
    craft = SimpleNamespace(t_ns=t_ns, interval_ns=10**9, without_fix=stretches(t_ns, fixes, 10**9))
    shapes, words = time_series.shades(craft)
    assert len(shapes) == 1
    assert "43200 epochs in 43200 stretches" in words


def test_two_runs_compared(run, prototype, tmp_path, capsys):
    page = tmp_path / "compared.html"
    assert main(["report", str(run), str(prototype), "--out", str(page)]) == 0
    out = capsys.readouterr().out
    assert out.endswith(f"\nreport: {page}\n")
    first, second = (json.loads((folder / "summary.json").read_text()) for folder in (run, prototype))
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


@pytest.mark.parametrize(
    ("name", "a", "b", "verdict"),
    [
        ("soyuz.position_error_m.rms", 2.0, 1.0, "better"),
        ("soyuz.converged.pdop.median", 1.0, 2.0, "worse"),
        ("soyuz.fixes", 10, 20, "better"),
        ("soyuz.no_fix.NO_ATTITUDE", 0, 3, "worse"),
        ("frames.rejected.CORRUPTED", 5, 0, "better"),
        ("soyuz.position_error_m.rms", 1.0, 1.004, ""),
        ("soyuz.position_error_m.rms", None, 1.0, ""),
        ("soyuz.assignment.commands", 1, 100, ""),
        ("soyuz.satellites_visible.mean", 1, 100, ""),
    ],
)
def test_better_and_worse(name, a, b, verdict):
    from gnss_hil.tools.report.compare import judged

    assert judged(name, a, b) == verdict


@pytest.mark.parametrize("name", ["soyuz.fixes", "frames.lost", "soyuz.outages.count"])
def test_counts_of_runs_of_other_length_are_not_judged(name):
    from gnss_hil.tools.report.compare import judged

    assert judged(name, 1, 100, same_length=False) == ""
    assert judged("soyuz.pdop.median", 1, 100, same_length=False) == "", "another share of it is cold"
    assert judged("soyuz.converged.pdop.median", 1, 100, same_length=False) == "worse"
    assert judged("soyuz.converged.pdop.max", 1, 100, same_length=False) == "", "it grows with the run"


@pytest.mark.parametrize(
    "name",
    ["real_time_factor", "epoch_latency_ms.p99", "mark_late_ms", "bus_load_percent.mean", "duration_s"],
)
def test_what_the_bench_takes_is_not_judged(name):
    from gnss_hil.tools.report.compare import judged

    assert judged(name, 1, 100) == judged(name, 100, 1) == ""


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
def test_runs_of_different_flights_are_not_judged(run, change, differs, tmp_path, capsys):
    other = tmp_path / "other"
    words = ["run", "soyuz", "--bus", "inline", "--duration", "90", "--no-report", "--quiet"]
    assert main([*words, *change, "--out", str(other)]) == 0
    capsys.readouterr()
    page = tmp_path / "compared.html"
    assert main(["report", str(run), str(other), "--out", str(page)]) == 0
    said = capsys.readouterr()
    why = "Nothing is judged better or worse: the runs are not of the same flight; they differ in"
    assert said.out.splitlines()[1] == f"{why} {differs}."
    assert not re.search(r"(better|worse)$", said.out.split(differs)[1], re.MULTILINE) and not said.err
    text = page.read_text("utf-8")
    assert why in text and 'class="good"' not in text and 'class="bad">better' not in text


def test_other_flight_software_and_other_errors_are_judged(run, tmp_path, capsys):
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
    assert main(["report", str(run), str(other), "--out", str(tmp_path / "page.html")]) == 0
    assert re.search(
        r"^soyuz\.position_error_m\.\S+ .* (better|worse)$", capsys.readouterr().out, re.MULTILINE
    )


def test_the_page_says_what_was_run(run):
    page = (run / "report.html").read_text("utf-8")
    facts = json.loads((run / "run.json").read_text())["about"]
    assert facts["version"] and facts["begun_utc"].endswith("Z") and facts["host"]["python"]
    assert facts["settings"]["time.duration_s"] == 90
    assert facts["command"].startswith("gnss-hil run soyuz --bus inline --duration 90")
    for part in ("What was run", facts["command"], facts["begun_utc"], "craft.0.orbit.altitude_km"):
        assert part in page


def test_a_page_of_another_emulator_says_nothing_of_its_own(run, copied):
    """The scenario asks for a craft in 2012; what flew is known from the bus alone."""
    text = (copied / "run.json").read_text().replace('"emulator": "ours"', '"emulator": "./theirs"')
    (copied / "run.json").write_text(text)
    scenario = (copied / "scenario.toml").read_text()
    (copied / "scenario.toml").write_text(scenario.replace("2012-10-31T00:15", "2020-01-01T00:00"))
    assert main(["report", str(copied)]) == 0
    page = (copied / "report.html").read_text("utf-8")
    assert "Emulator: ./theirs. What it played is known from the bus alone" in page
    assert "from 2012-10-31 00:15:00" in page and "2020-01-01" not in page.split("What was run")[0]
    assert "Soyuz MS in orbital attitude" not in page
    assert "as in the vehicle file handed over, soyuz-ms" in page


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
def test_a_folder_that_cannot_be_compared_is_told_in_one_line(run, copied, capsys, spoil, says):
    spoil(copied)
    assert main(["report", str(run), str(copied)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(copied) in line and says in line


def test_a_page_is_not_written_where_it_cannot_be(run, tmp_path, capsys):
    assert main(["report", str(run), "--out", str(tmp_path / "nowhere" / "a.html")]) == 2
    assert main(["report", str(run), "--out", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_remarks_are_told_written_and_drawn(tmp_path, capsys):
    """A run goes on with old elements: on the terminal even if quiet, in both JSON files, on the page."""
    (tmp_path / "old.tle").write_text(
        "1 99001U 12001A   12035.00000000  .00002000  00000-0  40000-4 0  9994\n"
        "2 99001  51.6000 100.0000 0005000  90.0000  10.0000 15.50000000  1001\n"
    )
    (tmp_path / "old.toml").write_text(
        'name = "old"\n[time]\nstart_gps = "2012-02-14T00:00:00"\nduration_s = 5\n[[craft]]\nname = "craft"\n'
        'vehicle = "soyuz-ms.toml"\ntrajectory = {tle = "old.tle"}\n'
    )
    out = tmp_path / "run"
    assert main(["run", str(tmp_path / "old.toml"), "--bus", "inline", "--quiet", "--out", str(out)]) == 0
    remark = (
        f"craft.craft.trajectory: {tmp_path / 'old.tle'}: elements of epoch 2012-02-04T00:00:15, 10.0 days"
    )
    assert f"gnss-hil: {remark}" in capsys.readouterr().err
    for name in ("run.json", "summary.json"):
        (told,) = json.loads((out / name).read_text())["remarks"]
        assert told.startswith(remark)
    assert (
        "10.0 days from the run" in (out / "report.html").read_text("utf-8").split("Remarks on its files")[1]
    )
