"""The study in small: what cancels, what does not, and what a mistake gives."""

import json

import numpy as np
import pytest

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.study.factors import largest, rms
from tests.support import browser

pytestmark = [
    pytest.mark.xdist_group("study of factors"),  # one study for all tests of it
    pytest.mark.verifies(
        "tools/study/runs.py",
        "tools/study/two_craft.py",
        "tools/study/factors.py",
        "tools/study/page.py",
        what="Studies: one factor at a time, two craft side by side",
        by="emulator and flight software of ours, played together; what two craft share cancels, noise does "
        "not",
        status="modelled",
    ),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("study")
    wanted = ("ephemeris_error", "code_noise", "ionosphere")
    factors = [x for name in wanted for x in ("--factor", name)]
    status = main(["study", "factors", "--duration", "1500", *factors, "--out", str(out), "--quiet"])
    assert status == 0
    return out


@pytest.fixture(scope="module")
def rows(folder):
    return {row["factor"]: row for row in json.loads((folder / "factors.json").read_text())}


@pytest.mark.slow
def test_the_page_is_whole_in_an_ordinary_window(folder, tmp_path):
    assert (folder / "factors.html").stat().st_size > 1_000_000, "plots and library inside"
    browser.require()
    seen = browser.look(folder / "factors.html", tmp_path, width=1400)
    assert seen.complaints == [] and seen.probe["cut"] == 0, "a table is cut off"
    assert all(plot["traces"] == 2 for plot in seen.probe["plots"])


@pytest.mark.slow
def test_without_factors_the_bus_is_all_that_is_left(rows):
    assert rows["none"]["fix_m"] < 5e-4


@pytest.mark.slow
def test_errors_of_the_sky_cancel_where_both_use_the_same_satellites(rows):
    assert rows["ephemeris_error"]["fix_m"] > 0.05
    assert rows["ephemeris_error"]["cancels"] > 100
    assert rows["ionosphere"]["cancels"] > 20
    assert rows["ephemeris_error"]["unlike_m"] > 10 * rows["ephemeris_error"]["alike_m"]


@pytest.mark.slow
def test_noise_does_not_cancel(rows):
    assert rows["code_noise"]["cancels"] < 2


def test_figures_of_vectors():
    vectors = np.array([[3.0, 4.0, 0.0], [np.nan] * 3, [0.0, 0.0, 1.0]])
    assert rms(vectors) == pytest.approx(13**0.5)
    assert largest(vectors) == 5.0
    assert np.isnan(rms(vectors[1:2]))


def test_a_scenario_of_one_craft_is_refused(capsys):
    assert main(["study", "factors", "soyuz"]) == 2
    assert "soyuz: 1 craft; a study of factors needs two" in capsys.readouterr().err
