"""PDOP of a fix whose navigator states none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.dilution import with_dilution
from gnss_hil.flightsw.estimation.position import solve
from gnss_hil.flightsw.records.solution import MAX_PDOP, NoFix, Solution
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET
from tests.support.fixes import craft, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/estimation/dilution.py",
    what="PDOP of navigators that state none",
    by="a snapshot of the same measurements",
    status="modelled",
)


@pytest.fixture(scope="module")
def offered():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 40), s.constellation()))
    none = np.zeros((3, len(m)))
    fix = solve(m, none, none, c.domain[m.receiver], None, BUDGET)
    return m, fix, FixInputs(None, c.lever_body, c.domain, BUDGET)


def stated(m, fix, inputs):
    return with_dilution(Solution(NoFix.FIX, fix), m, inputs).fix.pdop


def test_it_is_that_of_a_snapshot(offered):
    m, fix, inputs = offered
    assert stated(m, replace(fix, pdop=None), inputs) == pytest.approx(fix.pdop, rel=1e-6)


def test_measurements_not_used_do_not_count(offered):
    m, fix, inputs = offered
    fewer = replace(fix, pdop=None, used=np.arange(len(m)) % 2 == 0)
    assert stated(m, fewer, inputs) > 1.1 * fix.pdop


def test_what_a_navigator_states_stands(offered):
    m, fix, inputs = offered
    assert stated(m, replace(fix, pdop=7.0), inputs) == 7.0
    nothing = Solution(NoFix.TOO_FEW_SATELLITES)
    assert with_dilution(nothing, m, inputs) is nothing


@pytest.mark.parametrize("count", [0, 1, 3])
def test_too_few_for_a_fix_of_the_epoch_alone_are_the_most_the_contract_can_state(offered, count):
    m, fix, inputs = offered
    assert stated(m, replace(fix, pdop=None, used=np.arange(len(m)) < count), inputs) == MAX_PDOP


def test_a_geometry_poorer_than_the_contract_can_state_is_the_most_it_can(offered):
    """Six satellites within some 300 km of each other, a degree: a dilution of thousands."""
    m, fix, inputs = offered
    six = np.flatnonzero(m.sat < 64)[:6]
    middle = m.pos_sv_m[:, six[:1]]
    away = np.random.default_rng(2).normal(size=(3, 6)) * 3e5
    near = m[six]
    near = replace(near, pos_sv_m=middle + away)
    assert stated(near, replace(fix, pdop=None, used=np.ones(6, bool)), inputs) == MAX_PDOP
