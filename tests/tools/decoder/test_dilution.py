"""Dilution of a fix: against the textbook's matrix, for any systems and clocks."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.tools.decoder.dilution import distinct_pdop, distinct_satellites, paired_satellites

RANDOM = np.random.default_rng(4)


def textbook(los_m, clock, system) -> float:
    """sqrt of the trace of the position block of (G^T G)^-1, Kaplan & Hegarty, 3rd ed., 11.2; a column for
    each clock, and one for each system but the first."""
    columns = [los_m / np.linalg.norm(los_m, axis=1)[:, None]]
    columns += [(clock == c)[:, None] for c in np.unique(clock)]
    columns += [(system == s)[:, None] for s in np.unique(system)[1:]]
    design = np.hstack(columns).astype(float)
    return float(np.sqrt(np.trace(np.linalg.inv(design.T @ design)[:3, :3])))


@pytest.mark.parametrize("systems", [(0,), (1,), (0, 1), (0, 2), (1, 2, 5)])
@pytest.mark.parametrize("clocks", [(0,), (3,), (0, 7)])
def test_each_system_but_the_first_has_an_offset_and_each_domain_a_clock(systems, clocks):
    n = 14
    system = np.array([systems[i % len(systems)] for i in range(n)])
    clock = np.array([clocks[i // 3 % len(clocks)] for i in range(n)])
    los_m = RANDOM.normal(size=(n, 3)) * 2e7
    sat = system * NUMBERS + 1 + np.arange(n)
    found = distinct_pdop(np.zeros(n, np.int64), sat, clock, los_m, 1)
    assert found[0] == pytest.approx(textbook(los_m, clock, system), rel=1e-9)


def test_an_epoch_does_not_depend_on_the_others_of_its_block():
    """Bit for bit: tables made while a run goes on are those of its log, cut otherwise."""
    epoch = np.repeat([0, 2, 3], [8, 5, 9])
    sat = np.concatenate([np.arange(1, 9), np.arange(65, 70), np.r_[1:5, 65:70]])
    domain = np.r_[np.zeros(8, int), np.ones(5, int), np.arange(9) % 2]
    los_m = RANDOM.normal(size=(len(sat), 3)) * 2e7
    whole = distinct_pdop(epoch, sat, domain, los_m, 5)
    assert np.isnan(whole[[1, 4]]).all() and np.isfinite(whole[[0, 2, 3]]).all()
    for e in (0, 2, 3):
        mine = epoch == e
        alone = distinct_pdop(np.zeros(mine.sum(), np.int64), sat[mine], domain[mine], los_m[mine], 1)
        assert alone[0] == whole[e]


def test_a_satellite_on_several_channels_counts_once():
    los_m = RANDOM.normal(size=(6, 3)) * 2e7
    twice = np.r_[0:6, 2]
    zeros = np.zeros(7, np.int64)
    repeated = distinct_pdop(zeros, twice + 1, zeros, los_m[twice], 1)
    assert repeated[0] == pytest.approx(textbook(los_m, zeros[:6], zeros[:6]), rel=1e-9)
    assert distinct_satellites(np.r_[zeros, 2], np.r_[twice + 1, 9], 4).tolist() == [6, 0, 1, 0]


def test_too_few_satellites_have_none():
    los_m = RANDOM.normal(size=(3, 3)) * 2e7
    assert np.isnan(distinct_pdop(np.zeros(3, np.int64), np.arange(3), np.zeros(3, int), los_m, 1)).all()


def test_a_pair_is_two_carriers_of_one_receiver():
    """Epoch 0: G01 on both; epoch 1: on each of two receivers one; twice the same carrier; epoch 2: none."""
    l1, l2 = 1575.42e6, 1227.6e6
    rows = [(0, 0, 1, l1), (0, 0, 1, l2), (0, 1, 1, l1), (0, 1, 1, l2), (0, 0, 2, l1),
            (1, 0, 1, l1), (1, 1, 1, l2), (1, 2, 5, l1), (1, 2, 5, l1)]  # fmt: skip
    epoch, receiver, sat, hz = (np.array(column) for column in zip(*rows, strict=True))
    assert paired_satellites(epoch, receiver, sat, hz, 3).tolist() == [1, 0, 0]
    none = np.zeros(0, np.int64)
    assert paired_satellites(none, none, none, none.astype(float), 2).tolist() == [0, 0]
