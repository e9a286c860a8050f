"""report.html in a real browser."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.tools.command_line.main import main
from tests.support import browser
from tests.support.report_pages import SKIES, TITLES, drawn, played, titles

pytestmark = [
    pytest.mark.verifies(
        "tools/report/run_report.py",
        "tools/report/craft.py",
        "tools/report/time_series.py",
        "tools/report/ground_track.py",
        "tools/report/plot.py",
        "tools/report/summary_tables.py",
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


def test_every_plot_of_a_run_is_drawn(patent, tmp_path):
    page = patent / "report.html"
    assert page.stat().st_size < 3_000_000
    assert titles(page) == list(TITLES)
    probe = drawn(page, tmp_path)
    assert len(probe["plots"]) == len(TITLES)
    assert probe["scroll"] <= probe["width"] == 1200
    assert probe["cut"] == 0, "a table is cut off"
    spans = {tuple(plot["time"]) for plot in probe["plots"] if plot["time"]}
    assert len(spans) == 1, "plots over time show different stretches"


def test_satellites_of_two_carriers_have_a_row_where_there_are_any(patent, tmp_path):
    assert "of them by two carriers" not in (patent / "report.html").read_text("utf-8")
    words = ["--vehicle", "soyuz-ms-l1l2", "--ionosphere-free"]
    assert "of them by two carriers" in (played(tmp_path / "two", *words) / "report.html").read_text("utf-8")


def test_a_narrow_window_needs_no_sideways_scrolling(patent, tmp_path):
    probe = drawn(patent / "report.html", tmp_path, width=600, scheme=browser.DARK)
    assert probe["scroll"] <= probe["width"] == 600
    assert probe["colour"] == "dark"


@pytest.mark.parametrize("width", [500, 800, 1400])
def test_figures_fit_every_window_and_skies_leave_no_blank(patent, tmp_path, width):
    probe = drawn(patent / "report.html", tmp_path, width=width)
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


def test_light_and_dark_are_two_pictures_and_neither_is_blank(patent, tmp_path):
    browser.require()
    light, dark = (
        browser.screenshot(patent / "report.html", tmp_path, scheme)
        for scheme in (browser.LIGHT, browser.DARK)
    )
    assert light.shape == dark.shape
    for picture in (light, dark):
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200
    assert np.median(light) > 200 > 60 > np.median(dark)


def test_a_page_is_printed_whole_as_soon_as_it_is_loaded(patent, tmp_path):
    """Plots are there at the load event, and as wide as the paper before a print begins."""
    probe = drawn(patent / "report.html", tmp_path, width=1400)
    assert len(probe["loaded"]) == len(TITLES) and min(probe["loaded"]) > 300
    assert {*probe["printed"]} == {664}
    assert browser.strokes(patent / "report.html", tmp_path) > 1000


def test_a_met_and_a_missed_expectation_differ_in_colour():
    from gnss_hil.tools.report.summary_tables import expectations

    rows = [
        {"name": "a", "min": 1, "found": 2, "met": True},
        {"name": "b", "max": 1, "found": 2, "met": False},
    ]
    text = expectations({"expectations": rows})
    assert '<b class="good">met</b>' in text and '<b class="bad">MISSED</b>' in text


def test_a_run_without_faults_and_expectations_has_no_empty_card(patent):
    page = (patent / "report.html").read_text("utf-8")
    assert "Frame faults</h3>" not in page and "Expectations</h3>" not in page
    assert "expects nothing" in page and "No frame was lost" in page


def test_a_page_that_fails_is_noticed(patent, tmp_path):
    """The tests above would see an exception, a plot that is not drawn, and a stranger's address."""
    browser.require()
    whole = (patent / "report.html").read_text("utf-8")
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


def test_satellites_on_several_antennas_at_once_are_told(prototype, patent):
    assert re.search(
        r"several antennas held the satellite at once: \d+ satellites",
        (prototype / "report.html").read_text(),
    )
    assert "Diamonds are handovers" in (patent / "report.html").read_text()


def test_outages_are_counted_and_shaded(patent):
    """A cold start: 36 epochs without a fix, one shade."""
    from gnss_hil.dbc.common import vehicle
    from gnss_hil.tools.report import error_plots
    from gnss_hil.tools.report.craft import gather
    from gnss_hil.tools.results import assemble, run_digest, truth

    scenario, codecs = assemble.read_scenario(patent)
    names = [craft.name for craft in scenario.craft]
    digest = run_digest.from_log(patent / "bus.log", names, codecs)["soyuz"]
    craft = gather(
        "soyuz", vehicle.load(patent / "vehicle.toml"), 1.0, digest, truth.read(patent / "truth").rows, None
    )
    figure = error_plots.position_error(craft).figure
    (shade,) = figure["layout"]["shapes"]
    assert shade["x1"] - shade["x0"] == 36_000
    page = (patent / "report.html").read_text("utf-8")
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


def test_the_page_says_what_was_run(patent):
    page = (patent / "report.html").read_text("utf-8")
    facts = json.loads((patent / "run.json").read_text())["about"]
    assert facts["version"] and facts["begun_utc"].endswith("Z") and facts["host"]["python"]
    assert facts["settings"]["time.duration_s"] == 90
    assert facts["command"].startswith("gnss-hil run soyuz --bus inline --duration 90")
    for part in ("What was run", facts["command"], facts["begun_utc"], "craft.0.orbit.altitude_km"):
        assert part in page


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
    err = capsys.readouterr().err
    assert f"gnss-hil: {remark}" in err and err.count("elements of epoch") == 1
    for name in ("run.json", "summary.json"):
        (told,) = json.loads((out / name).read_text())["remarks"]
        assert told.startswith(remark)
    assert (
        "10.0 days from the run" in (out / "report.html").read_text("utf-8").split("Remarks on its files")[1]
    )
