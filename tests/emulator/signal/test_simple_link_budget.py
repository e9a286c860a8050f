"""Link budget: the interface documents' levels, the two gains that are given, what falls with what."""

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.signal import bands, simple_link_budget

pytestmark = [
    pytest.mark.verifies(
        "emulator/signal/bands.py",
        "emulator/signal/powers.py",
        what="Carrier frequencies, minimum powers",
        by="IS-GPS-200 table 3-Va, GLONASS ICD 3.3.1.6",
        status="validated",
    ),
    pytest.mark.verifies(
        "emulator/signal/simple_link_budget.py",
        what="C/N0: isotropic transmitters, receive gain linear in the cosine",
        by="use it in low orbit: beyond the Earth's edge a real transmit pattern falls",
        status="modelled",
    ),
]


def test_power_is_the_documents_minimum_at_five_degrees():
    """IS-GPS-200 table 3-Va: -158.5 dBW; GLONASS ICD 3.3.1.6: -161 dBW, both 5 deg above the horizon."""
    for system, dbw in ((satellites.GPS, -158.5), (satellites.GLONASS, -161.0)):
        band = next(b for b in bands.BANDS if b.system.value == system)
        distance = np.array([bands.slant_range_m(band.radius_m)])
        isotropic = simple_link_budget.cn0_dbhz(
            np.array([system]), distance, np.zeros((1, 1)), 0.0, 0.0, 290.0
        )
        assert isotropic[0, 0] == pytest.approx(dbw + 203.98, abs=0.01)  # k 290 K = -203.98 dBW/Hz


def test_slant_range_closes_the_triangle():
    radius, earth, elevation = 26_559_700.0, 6_378_137.0, np.deg2rad(5)
    d = bands.slant_range_m(radius)
    assert earth**2 + d**2 + 2 * earth * d * np.sin(elevation) == pytest.approx(radius**2, rel=1e-12)


def test_gain_passes_through_both_given_values_and_falls():
    angle = np.linspace(0, np.pi, 50)
    gain = simple_link_budget.gain_dbi(np.cos(angle), 4.0, -6.0)
    assert gain[0] == 4.0
    assert simple_link_budget.gain_dbi(np.cos(np.pi / 2), 4.0, -6.0) == pytest.approx(-6.0)
    assert (np.diff(gain) < 0).all()


def test_wavelengths():
    """GPS L1 19.03 cm; GLONASS channel -7 at 1598.0625 MHz, +6 at 1605.375 MHz (ICD 5.1, table 3.1)."""
    system = np.array([satellites.GPS, satellites.GLONASS, satellites.GLONASS])
    found = 299_792_458.0 / bands.wavelength_m(system, np.array([0, -7, 6]))
    assert found == pytest.approx([1575.42e6, 1598.0625e6, 1605.375e6], abs=1)


def test_twice_the_distance_costs_six_decibel():
    found = simple_link_budget.cn0_dbhz(
        np.zeros(2, int), np.array([2e7, 4e7]), np.zeros((1, 2)), 4.0, -6.0, 400.0
    )
    assert found[0, 0] - found[0, 1] == pytest.approx(20 * np.log10(2))
