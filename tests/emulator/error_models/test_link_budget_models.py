"""Parameters of the link budget, from a scenario's words to C/N0."""

from datetime import date

import numpy as np
import pytest
from pydantic import ValidationError

from gnss_hil.emulator.constellation import block_types
from gnss_hil.emulator.error_models import jamming as jamming_model
from gnss_hil.emulator.error_models import link_budget as link_model
from gnss_hil.emulator.error_models import receive_pattern, transmit_pattern
from gnss_hil.emulator.error_models.jamming import BodyJammer, EarthJammer, Jamming
from gnss_hil.emulator.error_models.link_budget import LinkBudget
from gnss_hil.emulator.error_models.receive_pattern import ReceivePattern
from gnss_hil.emulator.error_models.transmit_pattern import TransmitPattern
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.signal import antenna_patterns, jamming, link_budget

pytestmark = [
    pytest.mark.verifies(
        "emulator/error_models/transmit_pattern.py",
        "emulator/error_models/receive_pattern.py",
        "emulator/error_models/link_budget.py",
        "emulator/error_models/jamming.py",
        what="Link budget from a scenario's words",
        by="default temperatures and losses are typical, not ASN-M's",
        status="modelled",
    ),
    pytest.mark.verifies(
        "emulator/error_models/params.py",
        "emulator/error_models/base.py",
        "emulator/error_models/registry.py",
        what="Parameters of factors, their registry",
        by="ranges are ours; so are defaults, but for those whose source stands beside them",
        status="modelled",
    ),
]


def budget_of(transmit, receive, noise, names):
    transmitters = transmit_pattern.transmitters_of(transmit, date(2012, 10, 31))
    return link_budget.Budget(
        transmitters, receive_pattern.antennas_of(receive, names), *link_model.front_end_of(noise)
    )


def test_defaults_give_what_receivers_in_low_orbit_report():
    """A satellite of 2012 in the zenith of the ISS: GPS receivers in low orbits report some 45 to 55 dBHz."""
    table = budget_of(TransmitPattern(), ReceivePattern(), LinkBudget(), ("zenith", "fore"))
    angle = np.radians([[0.0, 0.0], [60.0, 60.0]])
    signal = np.array([0, 1])
    found = link_budget.cn0_dbhz(table, signal, np.array([5, 65]), np.zeros(2), np.full(2, 2e7), angle)
    assert (found[0] > 45).all() and (found[0] < 55).all()
    assert found[0] - found[1] == pytest.approx([5, 5])  # the law: 4 dBi to -1 dBi at 60 deg


def test_an_antenna_may_have_a_file_of_its_own(tmp_path):
    file = tmp_path / "deep.txt"
    file.write_text("0 -50\n180 -50\n")
    receive = ReceivePattern(pattern="isotropic", antennas={"aft": str(file)})
    table = budget_of(TransmitPattern(), receive, LinkBudget(), ("fore", "aft"))
    assert antenna_patterns.gain_dbi(table.antennas, np.ones((2, 1)))[:, 0].tolist() == [0, -50]


def test_a_table_that_ends_before_goes_down_to_the_floor(tmp_path):
    """From -5 dBi at 90 deg a straight line to -25 dBi at 180 deg."""
    file = tmp_path / "half.txt"
    file.write_text("0 3\n90 -5\n")
    antennas = receive_pattern.antennas_of(ReceivePattern(pattern=str(file), floor_dbi=-25.0), ("zenith",))
    angles = np.radians([[0.0, 90.0, 135.0, 180.0]])
    assert antenna_patterns.gain_dbi(antennas, angles)[0] == pytest.approx([3.0, -5.0, -15.0, -25.0])


def test_without_a_floor_nothing_is_received_behind_a_table(tmp_path):
    file = tmp_path / "half.txt"
    file.write_text("0 3\n90 -5\n")
    antennas = receive_pattern.antennas_of(ReceivePattern(pattern=str(file)), ("zenith",))
    found = antenna_patterns.gain_dbi(antennas, np.radians([[0.0, 90.0, 91.0, 180.0]]))[0]
    assert found[:2] == pytest.approx([3.0, -5.0])
    assert (found[2:] < -200).all()


def test_an_antenna_that_is_not_there_is_told():
    with pytest.raises(ValueError, match="antenna 'aft' is not there; there are fore, zenith"):
        receive_pattern.antennas_of(ReceivePattern(antennas={"aft": "isotropic"}), ("fore", "zenith"))


def test_jammers_keep_their_order_and_units():
    factor = Jamming(
        earth=(EarthJammer(latitude_deg=90.0, longitude_deg=0.0, eirp_dbw=40.0, kind="tone"),),
        body=(BodyJammer(direction_body=(0.0, 0.0, 1.0), received_dbw=-100.0, bandwidth_mhz=2.0),),
    )
    jam = jamming_model.jammers_of(factor)
    assert jam.place_ecef_m[0] == pytest.approx([0, 0, 6_356_752.314], abs=1e-3)
    assert (jam.kind, jam.centre_hz[0], jam.bandwidth_hz[1]) == (("tone", "noise"), 1575.42e6, 2e6)
    arrival = jamming.arrivals(jam, np.array([0.0, 0, 4.2e7]), np.eye(3))
    assert arrival.los_ecef == pytest.approx(np.array([[0, 0, -1], [0, 0, 1]]))
    assert 10 * np.log10(arrival.power_w[1]) == pytest.approx(-100)


def test_no_such_pattern_is_told_in_one_line():
    with pytest.raises(FileError, match=r"^nowhere\.txt: No such file or directory$"):
        link_budget.pattern_of("nowhere.txt", "", (4.0, -6.0))


@pytest.mark.parametrize(
    "make",
    (
        lambda: BodyJammer(direction_body=(0.0, 0.0, 0.0), received_dbw=-100.0),
        lambda: EarthJammer(latitude_deg=91.0, longitude_deg=0.0, eirp_dbw=10.0),
        lambda: Jamming(earth=[{"latitude_deg": 1.0}]),
        lambda: TransmitPattern(blocks={"G5": "gps-iif"}),
        lambda: TransmitPattern(gps="glonass-m"),
        lambda: ReceivePattern(floor_dbi=float("-inf")),
    ),
)
def test_what_makes_no_sense_is_refused(make):
    with pytest.raises(ValidationError):
        make()


def test_choices_are_the_blocks_there_are():
    for name in block_types.NAMES:
        kind = "R01" if name == "glonass-m" else "G01"
        assert TransmitPattern(blocks={kind: name}).blocks[kind] == name
