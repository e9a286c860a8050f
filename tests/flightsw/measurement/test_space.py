"""What satellites' own reports err by, by system and accuracy index."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.flightsw.measurement.space import URA_M, predicted, space_sigma

pytestmark = pytest.mark.verifies(
    "flightsw/measurement/space.py",
    what="Errors of satellites' orbits and clocks",
    by="indices of IS-GPS-200; 0.6 m and 2 m of Montenbruck et al. (2018); precise orbits in the whole chain",
    status="modelled",
)

GPS, GLONASS = 5, 64 + 7


def sigma_m(ura, sat=GPS, signal="L1P"):
    orbit_m, code_m, _ = space_sigma(
        np.array([float(ura)]), np.array([sat]), np.array([SIGNALS[signal].value])
    )
    return float(np.hypot(orbit_m, code_m)[0])


def test_indices_are_the_interface_documents():
    """Nominal accuracy by IS-GPS-200: index 0, 5, 6, 7, 14; -15 is a centimetre or better; 15 and -16 are no
    promise."""
    assert URA_M[[0, 5, 6, 7, 14]].tolist() == [2.0, 11.3, 16.0, 32.0, 4096.0]
    assert URA_M[-15] == pytest.approx(0.01, rel=0.15) and URA_M[-8] == 0.125
    assert URA_M[-1] == pytest.approx(2**0.5)
    assert np.isinf(URA_M[[15, -16]]).all()
    index = np.arange(-16, 16)
    assert index[~predicted(index.astype(float))].tolist() == [-16, 15]


def test_usual_satellites_err_by_what_was_found_in_years_not_by_what_they_promise():
    assert sigma_m(0) == 0.6
    assert sigma_m(4, GLONASS, "L1OF") == 2.0
    assert sigma_m(0, GLONASS, "L1OF") == 2.0


def test_worse_than_usual_is_worse_in_proportion_and_a_better_promise_is_taken_at_its_word():
    assert sigma_m(2) == pytest.approx(1.2)
    assert sigma_m(8) == pytest.approx(0.6 * 32)
    assert sigma_m(-8) == 0.125
    assert sigma_m(-15) < 0.012
    assert sigma_m(-4, GLONASS, "L1OF") == 0.5


def test_another_code_than_the_clocks_adds_what_satellites_differ_by():
    assert sigma_m(0, signal="L1CA") == pytest.approx(np.hypot(0.6, 0.28))
    assert sigma_m(-15, signal="L1CA") < 0.016, "a sky that promises to be exact has none"


def test_clocks_wander_within_a_second():
    rate = space_sigma(np.array([0.0, -15.0, 4.0]), np.array([GPS, GPS, GLONASS]), np.array([2, 2, 1]))[2]
    assert rate[0] == 0.0015 and rate[1] < 5e-5 and rate[2] == 0.003
