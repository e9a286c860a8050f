"""Plots of errors: every direction with its bands, squared errors and their 95 % band, words for the rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from gnss_hil.tools.report.error_plots import (
    CHI2_95,
    CHI2_MEDIAN,
    consistency,
    position_error,
    velocity_error,
)
from gnss_hil.tools.report.errors import Errors
from tests.support.plots import array, craft, named

pytestmark = [
    pytest.mark.verifies(
        "tools/report/error_plots.py",
        what="Report: plots of errors",
        by="chi-square by SciPy; errors drawn from a covariance that is true",
        status="validated",
    )
]


def errors(n=600, scale=1.0, sigma=2.0):
    value = np.random.default_rng(5).normal(0, 2.0 * scale, (n, 3))
    return Errors(value, np.full((n, 3), sigma), (value**2).sum(axis=1) / sigma**2)


def drawn(**more):
    return craft(600, **({"position": errors(), "velocity": errors(scale=2)} | more))


@pytest.mark.parametrize(("plot", "unit"), [(position_error, "[m]"), (velocity_error, "[m/s]")])
def test_three_directions_have_bands_and_a_line_each(plot, unit):
    figure = plot(drawn()).figure
    assert [len(named(figure, name)) for name in ("3 sigma", "1 sigma", "fix - truth")] == [3, 3, 3]
    titles = [figure["layout"][name]["title"]["text"] for name in ("yaxis", "yaxis2", "yaxis3")]
    assert titles == [f"{direction} {unit}" for direction in ("radial", "along", "cross")]
    assert array(named(figure, "3 sigma")[1]["y"]).max() == 6


def test_what_is_missing_is_said():
    assert "No truth" in velocity_error(drawn(velocity=None)).note
    lost = Errors(*(np.full(shape, np.nan) for shape in ((600, 3), (600, 3), 600)))
    assert "not one valid fix" in velocity_error(drawn(velocity=lost)).note
    bare = errors()
    bare = Errors(bare.value, np.full((600, 3), np.nan), np.full(600, np.nan))
    plot = velocity_error(drawn(velocity=bare))
    assert plot.figure is not None and "No sigma was published" in plot.note
    assert named(plot.figure, "1 sigma") == []
    assert "velocity has no covariance" in consistency(drawn(velocity=bare)).note
    assert consistency(drawn(position=bare, velocity=bare)).figure is None


def test_the_band_is_chi_square():
    assert pytest.approx(chi2.ppf((0.025, 0.975), 3), rel=1e-3) == CHI2_95
    assert pytest.approx(chi2.ppf(0.5, 3), rel=1e-3) == CHI2_MEDIAN


def test_a_covariance_that_is_true_is_told_from_one_that_promises_too_much():
    plot = consistency(drawn())
    inside = float(plot.note.split("position ")[1].split(", ")[1].split(" %")[0])
    too_much = float(plot.note.split("velocity ")[1].split(", ")[1].split(" %")[0])
    assert 92 <= inside <= 98 and too_much < 80
    position, velocity = (array(named(plot.figure, f"{n}, mean")[0]["y"]) for n in ("position", "velocity"))
    assert np.mean(position) == pytest.approx(3, rel=0.1) and np.mean(velocity) == pytest.approx(12, rel=0.1)
    band, three = plot.figure["layout"]["shapes"]
    assert (band["y0"], band["y1"], three["y0"]) == (*CHI2_95, 3)
