"""The plot of the receivers' clock: rows for what there is, words for what there is not."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.tools.report.clock_plots import clock
from gnss_hil.tools.report.errors import ClockErrors
from tests.support.plots import array, craft, named

pytestmark = pytest.mark.verifies(
    "tools/report/clock_plots.py", what="Report: receiver clock", by="craft made by hand", status="modelled"
)

LINE = np.linspace(0, 5, 50)
NONE = np.full(50, np.nan)


def drawn(bias=LINE, drift=LINE, sigma=LINE, truth=True):
    errors = ClockErrors(bias - 1, NONE) if truth else None
    fixes = {"clock_bias_m": bias, "clock_drift_mps": drift, "sigma_clock_bias_m": sigma}
    return clock(craft(50, fixes=fixes, clock=errors))


@pytest.mark.parametrize(
    ("how", "rows", "words"),
    [
        ({}, ["bias [m]", "bias - truth [m]", "drift [m/s]"], "Bands"),
        ({"truth": False}, ["bias [m]", "drift [m/s]"], "Every epoch has a fix"),
        ({"drift": NONE}, ["bias [m]", "bias - truth [m]"], "No drift is published"),
        ({"sigma": NONE}, ["bias [m]", "bias - truth [m]", "drift [m/s]"], "No sigma is published"),
    ],
)
def test_rows_are_what_there_is(how, rows, words):
    plot = drawn(**how)
    axes = [value for name, value in plot.figure["layout"].items() if name.startswith("yaxis")]
    assert [y["title"]["text"] for y in axes] == rows
    assert words in plot.note


def test_the_error_is_the_bias_less_the_truth():
    (trace,) = named(drawn().figure, "bias - truth")
    assert array(trace["y"]) == pytest.approx(LINE - 1, abs=1e-6)


def test_a_run_without_a_fix_has_no_clock():
    assert drawn(bias=NONE).figure is None
