"""The table of systems and signals: consistent in itself, and what the contract file says."""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.dbc.common.systems import SYSTEMS

pytestmark = pytest.mark.verifies(
    "dbc/common/systems.py",
    "dbc/common/signals.py",
    what="Systems and signals as one table",
    by="the contract file's value tables, byte for byte; carriers of GLONASS ICD 5.1, table 3.1",
    status="validated",
)

DBC = Path(__file__).parents[3] / "dbc/contract/gnss.dbc"


def dbc_table(name):
    """Label -> number of a value table in the shipped contract file."""
    (row,) = re.findall(rf"^VAL_TABLE_ {name} (.*) ;$", DBC.read_text(), re.M)
    return {label: int(number) for number, label in re.findall(r'(\d+) "(\w+)"', row)}


def test_the_contract_file_numbers_systems_signals_and_offsets_as_the_table():
    assert {s.name.upper(): s.value for s in SYSTEMS.values()} == dbc_table("SatSystem")
    assert {s.name: s.value for s in SIGNALS.values()} == dbc_table("Signal")
    offsets = {f"{s.name.upper()}_OFFSET": s.time_offset_item for s in systems.tracked() if not s.reference}
    assert offsets.items() <= dbc_table("ClockItem").items()
    assert min(offsets.values()) >= systems.CLOCK_DOMAINS


@pytest.mark.parametrize("key", ["value", "letter", "name"])
def test_no_two_systems_share_a_key(key):
    assert set(Counter(getattr(s, key) for s in SYSTEMS.values()).values()) == {1}


def test_one_system_is_the_reference_and_has_no_offset():
    assert systems.reference().time_offset_item is None
    assert systems.offset_items()[systems.reference().value] == -1


def test_every_tracked_system_has_a_preferred_signal_an_orbit_and_numbers():
    for system in systems.tracked():
        assert signals.of_system(system)
        assert 2e7 < system.orbit_radius_m < 5e7
        assert 0 < system.numbers < satellites.NUMBERS


def test_first_carriers_by_frequency_number():
    """GLONASS ICD 5.1, table 3.1: channel -7 at 1598.0625 MHz, +6 at 1605.375 MHz; GPS has one carrier."""
    carrier = signals.first_column(lambda s: s.carrier_hz, np.nan)
    spacing = signals.first_column(lambda s: s.spacing_hz, np.nan)
    r, g = SYSTEMS["glonass"].value, SYSTEMS["gps"].value
    np.testing.assert_allclose(carrier[r] + np.array((-7, 6)) * spacing[r], (1598.0625e6, 1605.375e6))
    assert (carrier[g], spacing[g]) == (1575.42e6, 0)
    assert signals.has_frequency_numbers().tolist() == [k == r for k in range(systems.COUNT)]


def test_every_name_of_a_satellite_is_read_back():
    for system in SYSTEMS.values():
        for number in (1, 63):
            index = int(satellites.index(system.value, number))
            assert satellites.parse(satellites.name(index)) == index
