"""docs/figures.md names every figure and every column that there are."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.emulator.truth import TRUTH
from gnss_hil.tools.results import outages, tables
from gnss_hil.tools.results.summary import RUN_FIGURES, metric_names

PAGE = (Path(__file__).parents[2] / "docs/figures.md").read_text("utf-8")
NAMED = set(re.findall(r"`([\w.]+)`", PAGE))


@pytest.mark.parametrize("table", ["FIXES", "EPOCHS", "CHANNELS", "ASSIGNMENTS"])
def test_every_column_is_named(table):
    assert set(getattr(tables, table)) <= NAMED


def test_every_column_of_the_truth_is_named():
    import numpy as np

    columns = set(tables._truth_rows(np.zeros(1, TRUTH)))
    assert {name for name in columns if not re.fullmatch(r"clock_\d_s", name)} <= NAMED


def test_every_figure_is_named():
    first = {name.split(".")[0] for name in NAMED}
    known, _ = metric_names(["a"], codec(4))
    of_craft = {name.split(".")[1] for name in known if name.startswith("a.")}
    assert of_craft <= first
    assert {name.split(".")[0] for name in RUN_FIGURES} <= first


def test_every_reason_and_the_definition_of_convergence_are_there():
    assert set(outages.REASONS) <= NAMED
    assert f"from {outages.CONVERGENCE_S:g} s after the first fix on" in PAGE
