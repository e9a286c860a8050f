"""What a satellite system asks of RINEX headers is in its row, and a system without a row asks nothing."""

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.tools.export import rinex_systems
from gnss_hil.tools.export.rinex_systems import SystemHeader, navigation_lines, observation_lines, opening
from gnss_hil.tools.export.rinex_text import labelled


def test_only_rows_of_a_system_are_given_to_it(decoded, monkeypatch):
    _, craft = decoded
    given = []

    def note(system, rows):
        given.append((system.name, rows))
        yield labelled("its line", "SOME LABEL")

    monkeypatch.setitem(rinex_systems.HEADERS, "gps", SystemHeader("gps", "GPS", observation=note))
    (line,) = observation_lines("G", craft.rows)
    ((name, rows),) = given
    assert name == "gps"
    assert line.endswith("SOME LABEL\n")
    assert 0 < len(rows) < len(craft.rows)
    np.testing.assert_array_equal(satellites.system_of(rows.sat), SYSTEMS["gps"].value)


def test_a_system_that_is_not_in_the_file_has_no_lines(decoded):
    _, craft = decoded
    assert not list(observation_lines("GE", craft.rows))
    assert not list(navigation_lines("GE", wgs84=True))


def test_glonass_has_its_frame_and_its_frequencies(decoded):
    _, craft = decoded
    text = "".join(observation_lines("GR", craft.rows))
    mine = craft.rows[satellites.system_of(craft.rows.sat) == SYSTEMS["glonass"].value]
    slots = dict(zip(satellites.number_of(mine.sat).tolist(), mine.frequency.tolist(), strict=True))
    assert text.startswith(f"{len(slots):3d} R")
    for slot, number in slots.items():
        assert f" R{slot:02d} {number:2d}" in text
    assert "WGS-84" in "".join(navigation_lines("R", wgs84=True))
    assert "GLONASS states are PZ-90 as of" in "".join(navigation_lines("R", wgs84=False))


def test_the_first_line_names_the_only_system():
    assert opening("N: GNSS NAV DATA", "R")[40:60].rstrip() == "R: GLONASS"
    assert opening("N: GNSS NAV DATA", "C")[40:60].rstrip() == "C: BDS"
    assert opening("N: GNSS NAV DATA", "E")[40:60].rstrip() == "E: Galileo"
    assert opening("N: GNSS NAV DATA", "GR")[40:60].rstrip() == "M: MIXED"
