"""Which block a GPS number was of."""

from datetime import date

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.emulator.constellation import block_types

pytestmark = pytest.mark.verifies(
    "emulator/constellation/block_types.py",
    what="GPS III antennas",
    by="stand in as IIR-M; the maker's tables were not at hand",
    status="modelled",
)

IIF, IIR, IIR_P, IIR_M, III = "gps-iif", "gps-iir", "gps-iir-improved", "gps-iirm", "gps-iii"

# PRN -> block in January 2021, as Stanford's LuPNT has it (data/gnss/gps_table.csv); IIR of PRN 2, 19 and 22
# carry the improved panel by W. Marquis, The GPS Block IIR/IIR-M Antenna Panel Pattern, 2014 (SVN 61, 59, 47)
JANUARY_2021 = {
    1: IIF, 2: IIR_P, 3: IIF, 4: III, 5: IIR_M, 6: IIF, 7: IIR_M, 8: IIF, 9: IIF, 10: IIF, 11: IIR, 12: IIR_M,
    13: IIR, 14: III, 15: IIR_M, 16: IIR, 17: IIR_M, 18: III, 19: IIR_P, 20: IIR, 21: IIR, 22: IIR_P, 23: III,
    24: IIF, 25: IIF, 26: IIF, 27: IIF, 28: IIR, 29: IIR_M, 30: IIF, 31: IIR_M, 32: IIF,
}  # fmt: skip


@pytest.mark.verifies(
    "emulator/constellation/block_types.py",
    what="Blocks of GPS numbers by date",
    by="a published table of January 2021; other dates by JPL's list of numbers",
    status="validated",
)
def test_january_2021_against_a_published_table():
    found = block_types.gps_blocks(date(2021, 1, 15))
    assert {number: found[number] for number in JANUARY_2021} == JANUARY_2021


def test_2012_flies_nine_old_satellites_and_three_new():
    """31 October 2012: IIF SVN 62, 63 and 65, the last launched on 4 October; SVN 49, a IIR-M, as PRN 27."""
    found = [block_types.gps_blocks(date(2012, 10, 31))[number] for number in range(1, 33)]
    assert [found.count(name) for name in ("gps-iia", IIF, III)] == [9, 3, 0]


@pytest.mark.parametrize(("day", "number", "block"), [
    (date(2009, 6, 1), 1, IIR_M),  # SVN 49, tested as PRN 1
    (date(2017, 6, 1), 4, "gps-iia"),  # SVN 38, taken out of storage
    (date(2018, 10, 1), 18, "gps-iia"),  # SVN 34, after SVN 54 and before the first III
    (date(2019, 8, 23), 18, III),
])  # fmt: skip
def test_a_number_is_its_last_holders(day, number, block):
    """Notices of the US Coast Guard's navigation centre on which satellite transmits as which PRN."""
    assert block_types.gps_blocks(day)[number] == block


def test_rows_follow_what_is_chosen():
    rows = block_types.block_rows(date(2021, 1, 15), "gps-iia", {"G05": IIF})
    assert block_types.NAMES[rows[satellites.parse("G05")]] == IIF
    assert block_types.NAMES[rows[satellites.parse("G06")]] == "gps-iia"
    assert block_types.NAMES[rows[satellites.parse("R24")]] == "glonass-m"
    assert rows[satellites.parse("E11")] == block_types.NO_BLOCK
    assert np.all(rows <= block_types.NO_BLOCK)


def test_a_satellite_cannot_be_of_another_systems_block():
    with pytest.raises(ValueError, match="R05 cannot be of block gps-iif"):
        block_types.block_rows(date(2021, 1, 15), "by-date", {"R05": IIF})


SENDING = {
    "L2C": (1, 3, 5, 6, 7, 8, 9, 10, 12, 15, 17, 24, 25, 26, 27, 29, 30, 31, 32, 4, 14, 18, 23),
    "L5": (1, 3, 6, 8, 9, 10, 24, 25, 26, 27, 30, 32, 4, 14, 18, 23),
}
"""Numbers that sent the signal in January 2021, as JANUARY_2021 has their blocks: L2C from IIR-M on, L5 from
IIF on (IS-GPS-200 and -705)."""


@pytest.mark.verifies(
    "emulator/constellation/block_types.py",
    what="Which satellites send a second carrier",
    by="blocks by a published table of January 2021, signals of blocks by the interface documents",
    status="validated",
)
def test_second_carriers_come_from_the_blocks_that_have_them():
    sent = block_types.sent_signals(block_types.block_rows(date(2021, 1, 15), "by-date", {}))
    gps = satellites.index(satellites.GPS, np.arange(1, 33))
    for name, numbers in SENDING.items():
        assert set(1 + np.flatnonzero(sent[SIGNALS[name].value, gps])) == set(numbers), name
        assert not np.delete(sent[SIGNALS[name].value], np.arange(64)).any()
    glonass = satellites.index(satellites.GLONASS, np.arange(1, 25))
    assert sent[SIGNALS["L2OF"].value, glonass].all() and not sent[SIGNALS["L2OF"].value, gps].any()
    assert sent[SIGNALS["L1CA"].value, gps].all() and sent[SIGNALS["L1OF"].value, glonass].all()
    assert not sent[SIGNALS["L1CA"].value, glonass].any()
