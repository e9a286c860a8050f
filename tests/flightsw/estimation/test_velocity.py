"""Velocity from range rates: what one rate more or less moves, by NumPy's inverse of the geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.integrity.exclusion import Rules
from gnss_hil.flightsw.measurement.ionosphere import USUAL, Ionosphere, delay, delay_rate
from gnss_hil.flightsw.measurement.range_model import rays
from gnss_hil.flightsw.records.solution import NoFix
from tests.support import synthetic_epochs as s
from tests.support.fixes import SKY, craft, errors, fix_of, in_view, measurements, noise_of

GPS = [sat for sat in SKY if sat < 64]
CN0 = np.array([50.0, 30.0, 44.0, 36.0, 47.0, 33.0, 41.0, 38.0])


def weak_and_strong(c):
    """Eight satellites, of very different C/N0."""
    m = measurements(s.observe(c, in_view(c, 8, sats=GPS), SKY))
    return replace(m, rate_variance_m2ps2=noise_of(CN0, m.sat)[1])


def geometry(c, m):
    """(n, 4) direction from each satellite and clock, where the craft is."""
    away = m.pos_sv_m.T - s.truth_ecef(c)[0]
    return np.column_stack((-away / np.linalg.norm(away, axis=1)[:, None], np.ones(len(away))))


def moved_by(rows, row):
    """How a fix's velocity and clock rate follow the rate of one of the rows: weighted least squares, with
    variances of a frequency lock loop of 20 ms: by C/N0, and once more where it is 50 Hz."""
    h, cn0 = rows
    ratio = 10 ** (cn0 / 10)
    weight = ratio / (1 + 50 / ratio)
    return (np.linalg.inv(h.T @ (weight[:, None] * h)) @ (h.T * weight))[:, row]


@pytest.mark.parametrize("row", range(8))
def test_each_range_rate_weighs_by_its_own_noise(row):
    c = craft()
    m = weak_and_strong(c)
    more = replace(m, range_rate_mps=m.range_rate_mps + 0.02 * (np.arange(8) == row))
    found = (fix_of(c, more).velocity_mps - fix_of(c, m).velocity_mps) / 0.02
    assert found == pytest.approx(moved_by((geometry(c, m), CN0), row)[:3], abs=2e-3)


@pytest.mark.parametrize("row", range(1, 8))
def test_it_does_after_an_exclusion_too(row):
    """The first satellite is 60 m/s wrong and left out."""
    c = craft()
    m = weak_and_strong(c)
    wrong = replace(m, range_rate_mps=m.range_rate_mps + 60.0 * (np.arange(8) == 0))
    more = replace(wrong, range_rate_mps=wrong.range_rate_mps + 0.02 * (np.arange(8) == row))
    found = (fix_of(c, more).velocity_mps - fix_of(c, wrong).velocity_mps) / 0.02
    rest = geometry(c, m)[1:], CN0[1:]
    assert found == pytest.approx(moved_by(rest, row - 1)[:3], abs=2e-3)


def test_five_satellites_are_enough_to_trust_the_rates_of_all():
    c = craft()
    fix = fix_of(c, measurements(s.observe(c, in_view(c, 5, sats=GPS), SKY)))
    assert fix.velocity_mps is not None and errors(c, fix)[1] < 1e-3


def test_dilution_is_that_of_the_geometry():
    """PDOP^2 is the trace of the inverse of H'H over the position, all measurements alike."""
    c = craft()
    m = weak_and_strong(c)
    h = geometry(c, m)
    assert fix_of(c, m).pdop == pytest.approx(np.sqrt(np.trace(np.linalg.inv(h.T @ h)[:3, :3])), rel=1e-3)


def test_the_ionosphere_delays_the_code_and_advances_the_carrier():
    """Delays and rates of the flight software's own model, put on ranges as nature does: the fix is free of
    both where it knows of an ionosphere; where it does not, they contradict each other."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, 16), SKY))
    place, velocity = s.truth_ecef(c)
    sky = Ionosphere(USUAL, 50_400.0)
    antenna_m = place[:, None] + np.zeros((3, len(m)))
    seen = rays(m.pos_sv_m, antenna_m)
    late = delay(sky, antenna_m, seen.los, seen.distance_m)
    rate = delay_rate(sky, seen, velocity[:, None] + np.zeros((3, len(m))), m.vel_sv_mps)
    m = replace(
        m,
        pseudorange_m=m.pseudorange_m + late.modelled_m,
        range_rate_mps=m.range_rate_mps - rate.modelled_m,
    )
    known = errors(c, fix_of(c, m, ionosphere=sky))
    assert known[0] < 0.05 and known[1] < 2e-4
    assert fix_of(c, m) == NoFix.INCONSISTENT_RANGES


def test_range_rates_that_disagree_make_a_velocity_less_certain():
    """By the variance of unit weight, of NumPy's weighted lstsq: what is left of two wrong rates, over the
    four of eight that are more than there are unknowns."""
    c = craft()
    m = weak_and_strong(c)
    off = 2.0 * (np.arange(8) == 1) - 3.0 * (np.arange(8) == 4)
    agreed = fix_of(c, m)
    fix = fix_of(c, replace(m, range_rate_mps=m.range_rate_mps + off), rules=Rules(0, 0, refuse=False))
    root = 1 / np.sqrt(m.rate_variance_m2ps2)
    _, left, *_ = np.linalg.lstsq(root[:, None] * geometry(c, m), root * off, rcond=None)
    grown = np.trace(fix.velocity_covariance_m2ps2) / np.trace(agreed.velocity_covariance_m2ps2)
    assert grown == pytest.approx(left[0] / 4, rel=0.02) and grown > 100
