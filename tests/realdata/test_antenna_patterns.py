"""Shipped transmit patterns against published means of the same blocks; every real table is read."""

import numpy as np
import pytest

from gnss_hil.emulator.files import antenna_table
from gnss_hil.emulator.signal import link_budget
from tests.support.outside import data_file

pytestmark = pytest.mark.realdata

TABLES = ("GPSIIA_L1MEAN", "GPSIIRM_P1_L1MEAN_30deg", "GPSIIR_ALL_L1MEAN_30deg", "ballhybrid_10db_60deg",
          "sensysmeas_ant", "trimblepatch_ant")  # fmt: skip


@pytest.mark.verifies(
    "emulator/files/antenna_table.py",
    what="Antenna tables",
    by="NumPy reads the same from every real table; any text is read or refused in words",
    status="validated",
)
@pytest.mark.parametrize("name", TABLES)
def test_every_table_is_read_as_numpy_reads_it(name):
    path = data_file(f"antenna_patterns/{name}.txt")
    angle, gain = np.loadtxt(path, comments="%").T
    found = antenna_table.read(path)
    assert found.angle_deg == pytest.approx(angle[angle >= 0]) and found.gain_db == pytest.approx(
        gain[angle >= 0]
    )


@pytest.mark.parametrize("column, peak", (("Gt_GPSL1_dB", 10), ("Gt_GLOL1_dB", 15), ("Gr_L1_dB", 0)))
def test_columns_of_the_table_with_three(column, peak):
    found = antenna_table.read(data_file("antenna_patterns/RadPatt_derived.csv"), column)
    assert len(found.angle_deg) == 181 and found.gain_db.argmax() == peak


@pytest.mark.verifies(
    "emulator/signal/link_budget.py",
    "emulator/signal/antenna_patterns.py",
    "emulator/data/patterns/gps-iir.txt",
    "emulator/data/patterns/gps-iir-improved.txt",
    "emulator/data/patterns/glonass-m.txt",
    what="Transmit patterns: GPS IIR and IIR-M to 30 deg, main lobe of GLONASS-M",
    by=(
        "NASA's mean gains of IIR panels, one of them ours (0.7 dB main lobe, 1.6 dB first side lobe); a "
        "table of unstated source, 1.7 dB to 18 deg (GLONASS)"
    ),
    status="validated",
)
@pytest.mark.parametrize(
    "shipped, published, loss_db",
    (("gps-iir", "GPSIIR_ALL_L1MEAN_30deg", 1.0), ("gps-iir-improved", "GPSIIRM_P1_L1MEAN_30deg", 1.35)),
)
def test_panels_against_mean_gains_of_other_satellites(shipped, published, loss_db):
    """Our directivities of SVN 43 and 48 against NASA's mean gains of SVN 41, 43, 54 and of IIR-M panel 1.

    The loss between directivity and gain is 1.0 and 1.35 dB (a published program takes 1.3 and 1.4). From 8
    to 22 deg the improved panel agrees within 0.1 dB: panel 1 may be the same piece. Main lobe within 0.7 dB,
    first side lobe (from 26 deg) within 1.6 dB; the null between moves from panel to panel.
    """
    ours, theirs = (
        link_budget.shipped(shipped),
        antenna_table.read(data_file(f"antenna_patterns/{published}.txt")),
    )
    apart = np.interp(theirs.angle_deg, ours.angle_deg, ours.gain_db) - loss_db - theirs.gain_db
    assert np.abs(apart[theirs.angle_deg <= 18]).max() < 0.7
    assert np.abs(apart[theirs.angle_deg >= 26]).max() < 1.6


@pytest.mark.verifies(
    "emulator/data/patterns/gps-iia.txt",
    "emulator/data/patterns/gps-iif.txt",
    "emulator/data/patterns/glonass-m.txt",
    what="Transmit patterns: GPS IIA and IIF, side lobes of GLONASS-M, all beyond",
    by=(
        "IIA and IIF typed from their publishers (IIF's side lobes thinned, its main lobe of a program that "
        "names no source), without a second judge; no GPS antenna radiates more than it is fed; GLONASS "
        "beyond 26 deg is a floor, and behind 90 deg no block sends anything"
    ),
    status="modelled",
)
def test_the_old_blocks_table_is_typed_as_published():
    """Czopek & Shollenberger's mean, as NASA tabulates it: no judge of the pattern, only of the typing."""
    ours, theirs = (
        link_budget.shipped("gps-iia"),
        antenna_table.read(data_file("antenna_patterns/GPSIIA_L1MEAN.txt")),
    )
    assert ours.gain_db[: len(theirs.gain_db)] == pytest.approx(theirs.gain_db)


@pytest.mark.verifies(
    what="Transmit patterns: GPS IIR and IIR-M to 30 deg, main lobe of GLONASS-M",
)
def test_glonass_main_lobe_against_another_table():
    """A table of unstated source: shape within 1.7 dB to 18 deg."""
    ours = link_budget.shipped("glonass-m")
    theirs = antenna_table.read(data_file("antenna_patterns/RadPatt_derived.csv"), "Gt_GLOL1_dB")
    lobe = theirs.angle_deg <= 18
    apart = (np.interp(theirs.angle_deg, ours.angle_deg, ours.gain_db) - ours.gain_db.max()) - (
        theirs.gain_db - theirs.gain_db.max()
    )
    assert np.abs(apart[lobe]).max() < 1.7
