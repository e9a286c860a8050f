"""Axes of plots: ticks of logarithmic ones can be read, whatever they span; rows share one time axis."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.tools.report.plot import axis, line, log_axis, log_ticks, numbers, piled, positive_span

pytestmark = pytest.mark.verifies(
    "tools/report/plot.py", what="Report: axes", by="ticks known without a computer", status="validated"
)


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0.01, 50, [0.01, 0.1, 1, 10, 100]),
        (0.7, 28, [0.5, 1, 2, 5, 10, 20, 50]),
        (0.71, 0.86, [0.7, 0.8, 0.9]),
        (1, 10, [1, 1.5, 2, 3, 5, 7, 10]),
        (3, 3, [3.0, 3.5]),
        (1e-9, 1e9, [1e-9, 1e-6, 1e-3, 1, 1e3, 1e6, 1e9]),
    ],
)
def test_ticks_are_round_and_few(low, high, ticks):
    assert log_ticks(low, high) == pytest.approx(ticks)


@pytest.mark.parametrize("low", [1e-6, 0.013, 0.5, 0.99, 1.0, 7.3, 4.2e5])
@pytest.mark.parametrize("ratio", [1.0, 1.01, 1.5, 3, 12, 170, 1e5, 3e12])
def test_every_span_has_two_to_eight_labels_that_say_the_whole_value(low, ratio):
    y = log_axis("PDOP", low, low * ratio)
    assert 2 <= len(y["tickvals"]) <= 8
    assert [float(words) for words in y["ticktext"]] == pytest.approx(y["tickvals"])
    begin, end = (10**limit for limit in y["range"])
    assert begin <= low * (1 + 1e-9) and end >= low * ratio * (1 - 1e-9)
    assert sum(begin * (1 - 1e-9) <= v <= end * (1 + 1e-9) for v in y["tickvals"]) >= 2


def test_what_a_logarithm_cannot_show_has_no_part_in_the_span():
    assert positive_span(np.array([np.nan, 0, -3, np.inf, 2]), np.array([7.0])) == (2, 7)
    assert positive_span(np.array([np.nan])) == (1, 10)


def test_rows_stand_below_each_other_and_are_named_once():
    t_ns = np.array([0, 10**9])
    one = line("a", numbers(t_ns), numbers(t_ns), "--accent")
    figure = piled(t_ns, [(axis("x"), [one]), (axis("y"), [one])])
    assert [trace["showlegend"] for trace in figure["data"]] == [True, False]
    assert [trace["yaxis"] for trace in figure["data"]] == ["y", "y2"]
    upper, lower = figure["layout"]["yaxis"]["domain"], figure["layout"]["yaxis2"]["domain"]
    assert upper[0] > lower[1] and figure["layout"]["xaxis"]["anchor"] == "y2"
